#include "mapping/local_bundle.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "mapping/line_mapping.hpp"

namespace ipl_slam {
namespace {

std::set<KeyframeId> choose_free_keyframes(const Map& map, KeyframeId centre,
                                           const LocalBundleOptions& options) {
  std::set<KeyframeId> chosen{centre};
  for (const Covisible& neighbour : map.covisible(centre)) {
    if (neighbour.shared < options.min_shared || static_cast<int>(chosen.size()) >= options.max_keyframes)
      break;
    chosen.insert(neighbour.keyframe);
  }
  return chosen;
}

// The landmarks of one kind that the keyframes see: Keyframe::points or Keyframe::lines.
template <class LandmarkId>
std::vector<LandmarkId> landmarks_of(const Map& map, const std::set<KeyframeId>& keyframes,
                                     std::vector<LandmarkId> Keyframe::*seen) {
  std::set<LandmarkId> landmarks;
  for (const KeyframeId id : keyframes) {
    for (const LandmarkId landmark : map.keyframes()[id].*seen) {
      if (landmark.valid()) landmarks.insert(landmark);
    }
  }
  return {landmarks.begin(), landmarks.end()};
}

// The problem around a keyframe, and what its indices stand for in the map.
class LocalBundle {
 public:
  LocalBundle(const Map& map, KeyframeId centre, const LocalBundleOptions& options);
  void write_back(Map& map, const BundleResult& result, const Camera& camera,
                  const DepthNoiseOptions& noise) const;

  BundleProblem problem;

 private:
  [[nodiscard]] std::set<KeyframeId> choose_fixed_keyframes(const Map& map, const std::set<KeyframeId>& free,
                                                            int limit) const;
  void add_pose(const Map& map, KeyframeId id, bool fixed);
  void add_points(const Map& map);
  void add_lines(const Map& map, const LocalBundleOptions& options);

  std::vector<KeyframeId> poses_;
  std::map<KeyframeId, std::uint32_t> pose_index_;
  std::vector<PointId> points_;
  std::vector<LineId> lines_;
  std::vector<std::pair<PointId, KeyframeId>> point_owners_;  // of the observations
  std::vector<std::pair<LineId, KeyframeId>> line_owners_;
};

LocalBundle::LocalBundle(const Map& map, KeyframeId centre, const LocalBundleOptions& options) {
  const std::set<KeyframeId> free = choose_free_keyframes(map, centre, options);
  points_ = landmarks_of(map, free, &Keyframe::points);
  lines_ = landmarks_of(map, free, &Keyframe::lines);
  const std::set<KeyframeId> fixed = choose_fixed_keyframes(map, free, options.max_fixed_keyframes);
  // The anchor holds the world frame; without fixed neighbours the oldest of the window does.
  for (const KeyframeId id : free)
    add_pose(map, id, map.is_anchor(id) || (fixed.empty() && id == *free.begin()));
  for (const KeyframeId id : fixed) add_pose(map, id, true);
  add_points(map);
  add_lines(map, options);
}

// Of the other keyframes that see the landmarks, those that see most of them.
std::set<KeyframeId> LocalBundle::choose_fixed_keyframes(const Map& map, const std::set<KeyframeId>& free,
                                                         int limit) const {
  std::map<KeyframeId, int> shared;
  const auto count = [&](const std::vector<Observation>& observations) {
    for (const Observation& o : observations) {
      if (!free.contains(o.keyframe)) ++shared[o.keyframe];
    }
  };
  for (const PointId id : points_) count(map.points()[id].observations);
  for (const LineId id : lines_) count(map.lines()[id].observations);
  std::vector<std::pair<int, KeyframeId>> order;
  for (const auto& [id, times] : shared) order.emplace_back(-times, id);
  std::sort(order.begin(), order.end());
  std::set<KeyframeId> chosen;
  for (const auto& [times, id] : order) {
    if (static_cast<int>(chosen.size()) >= limit) break;
    chosen.insert(id);
  }
  return chosen;
}

void LocalBundle::add_pose(const Map& map, KeyframeId id, bool fixed) {
  pose_index_[id] = static_cast<std::uint32_t>(poses_.size());
  poses_.push_back(id);
  problem.poses.push_back({map.keyframes()[id].T_cw, fixed});
}

void LocalBundle::add_points(const Map& map) {
  for (std::uint32_t i = 0; i < points_.size(); ++i) {
    const Point& point = map.points()[points_[i]];
    problem.points.push_back(point.position);
    for (const Observation& o : point.observations) {
      const auto pose = pose_index_.find(o.keyframe);
      if (pose == pose_index_.end()) continue;
      const Keypoint& keypoint = map.keyframes()[o.keyframe].frame->features.keypoints[o.feature];
      problem.observations.push_back({pose->second, i, keypoint.undistorted.cast<double>(), keypoint.depth,
                                      map.pyramid().sigma2(keypoint.level), 1.0});
      point_owners_.emplace_back(points_[i], o.keyframe);
    }
  }
}

void LocalBundle::add_lines(const Map& map, const LocalBundleOptions& options) {
  for (std::uint32_t i = 0; i < lines_.size(); ++i) {
    const Line& line = map.lines()[lines_[i]];
    problem.lines.push_back(line.line);
    for (const Observation& o : line.observations) {
      const auto pose = pose_index_.find(o.keyframe);
      if (pose == pose_index_.end()) continue;
      const LineSegment& segment = map.keyframes()[o.keyframe].line_features->segments[o.feature];
      const double sigma = options.line_sigma * std::exp2(segment.octave);
      // The two ends count as independent: their covariance is small beside line_depth_sigma.
      const auto depth_sigma = [&](int end) {
        return std::hypot(options.line_depth_sigma, std::sqrt(segment.depth.covariance(end, end)));
      };
      problem.line_observations.push_back({.pose = pose->second,
                                           .line = i,
                                           .start = segment.start.cast<double>(),
                                           .end = segment.end.cast<double>(),
                                           .sigma2 = sigma * sigma,
                                           .inverse_start = segment.depth.inverse_start,
                                           .inverse_end = segment.depth.inverse_end,
                                           .sigma_start = depth_sigma(0),
                                           .sigma_end = depth_sigma(1)});
      line_owners_.emplace_back(lines_[i], o.keyframe);
    }
  }
}

void LocalBundle::write_back(Map& map, const BundleResult& result, const Camera& camera,
                             const DepthNoiseOptions& noise) const {
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    if (!problem.poses[i].fixed) map.set_pose(poses_[i], problem.poses[i].T_cw);
  }
  for (std::size_t i = 0; i < points_.size(); ++i) map.set_position(points_[i], problem.points[i]);
  // Cut short, it cannot tell what is wrong from what it had no time to fit.
  const auto remove_outliers = [&](const auto& owners, const std::vector<std::uint8_t>& outlier) {
    for (std::size_t i = 0; i < owners.size() && !result.aborted; ++i) {
      const auto& [landmark, keyframe] = owners[i];
      // The landmark may have gone with an observation before.
      if (outlier[i] && map.resolve(landmark) == landmark) map.remove_observation(landmark, keyframe);
    }
  };
  remove_outliers(point_owners_, result.outlier);
  remove_outliers(line_owners_, result.line_outlier);
  for (const PointId id : points_) {
    if (map.points().contains(id)) map.refresh(id);
  }
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    const LineId id = lines_[i];
    if (!map.lines().contains(id)) continue;
    const Line& line = map.lines()[id];
    const Line3& adjusted = problem.lines[i];
    if (const auto extent = observed_extent(map, camera, noise, adjusted, line.observations)) {
      map.set_line(id, adjusted, extent->first, extent->second);
      map.refresh(id);
    } else if (result.aborted) {
      map.set_line(id, adjusted, adjusted.nearest_to(line.start), adjusted.nearest_to(line.end));
    } else {
      map.remove(id);
    }
  }
}

}  // namespace

void adjust_local_bundle(Map& map, KeyframeId centre, const Camera& camera, const DepthNoiseOptions& noise,
                         const LocalBundleOptions& options, const std::atomic<bool>* abort) {
  LocalBundle bundle(map, centre, options);
  const BundleResult result = adjust_bundle(bundle.problem, camera, noise, options.solver, abort);
  bundle.write_back(map, result, camera, noise);
}

}  // namespace ipl_slam
