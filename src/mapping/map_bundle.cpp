#include "mapping/map_bundle.hpp"

#include <algorithm>
#include <cmath>

#include "mapping/line_mapping.hpp"
#include "mapping/seen_landmarks.hpp"

namespace ipl_slam {
namespace {

// Those of the landmarks with enough observations.
template <class LandmarkId, class Landmark>
std::vector<LandmarkId> seen_often(const Store<LandmarkId, Landmark>& landmarks, std::vector<LandmarkId> ids,
                                   std::size_t min_observations) {
  std::erase_if(ids, [&](LandmarkId id) { return landmarks[id].observations.size() < min_observations; });
  return ids;
}

}  // namespace

MapBundle::MapBundle(const Map& map, const std::set<KeyframeId>& free, const std::set<KeyframeId>& fixed,
                     const LineNoise& line_noise, std::size_t min_observations)
    : points_(seen_often(map.points(), seen_landmarks(map, free, &Keyframe::points), min_observations)),
      lines_(seen_often(map.lines(), seen_landmarks(map, free, &Keyframe::lines), min_observations)) {
  // An anchor holds the world frame; where nothing else does, the oldest keyframe.
  for (const KeyframeId id : free)
    add_pose(map, id, map.is_anchor(id) || (fixed.empty() && id == *free.begin()));
  for (const KeyframeId id : fixed) add_pose(map, id, true);
  add_points(map);
  add_lines(map, line_noise);
}

void MapBundle::add_pose(const Map& map, KeyframeId id, bool fixed) {
  pose_index_[id] = static_cast<std::uint32_t>(poses_.size());
  poses_.push_back(id);
  problem.poses.push_back({map.keyframes()[id].T_cw, fixed});
}

void MapBundle::add_points(const Map& map) {
  for (std::uint32_t i = 0; i < points_.size(); ++i) {
    const Point& point = map.points()[points_[i]];
    problem.points.push_back(point.position);
    for (const Observation& o : point.observations) {
      const auto pose = pose_index_.find(o.keyframe);
      if (pose == pose_index_.end()) continue;
      const Keypoint& keypoint = map.keyframes()[o.keyframe].frame->features.keypoints[o.feature];
      problem.observations.push_back({pose->second, i, keypoint.undistorted.cast<double>(), keypoint.depth,
                                      map.pyramid().sigma2(keypoint.level), 1.0});
      point_sights_.push_back({points_[i], o});
    }
  }
}

void MapBundle::add_lines(const Map& map, const LineNoise& noise) {
  for (std::uint32_t i = 0; i < lines_.size(); ++i) {
    const Line& line = map.lines()[lines_[i]];
    problem.lines.push_back(line.line);
    for (const Observation& o : line.observations) {
      const auto pose = pose_index_.find(o.keyframe);
      if (pose == pose_index_.end()) continue;
      const LineSegment& segment = map.keyframes()[o.keyframe].line_features->segments[o.feature];
      const double sigma = noise.sigma * std::exp2(segment.octave);
      // The two ends count as independent: their covariance is small beside depth_sigma.
      const auto depth_sigma = [&](int end) {
        return std::hypot(noise.depth_sigma, std::sqrt(segment.depth.covariance(end, end)));
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
      line_sights_.push_back({lines_[i], o});
    }
  }
}

// Observations that are still what they were when the problem was made.
template <class LandmarkId>
void MapBundle::remove_outliers(Map& map, const std::vector<Sight<LandmarkId>>& sights,
                                const std::vector<std::uint8_t>& outlier,
                                std::vector<LandmarkId> Keyframe::*seen) {
  for (std::size_t i = 0; i < sights.size(); ++i) {
    const auto& [landmark, o] = sights[i];
    if (!outlier[i] || !map.keyframes().contains(o.keyframe)) continue;
    if ((map.keyframes()[o.keyframe].*seen)[o.feature] == landmark)
      map.remove_observation(landmark, o.keyframe);
  }
}

void MapBundle::write_back(Map& map, const BundleResult& result, const Camera& camera,
                           const DepthNoiseOptions& noise) const {
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    if (!problem.poses[i].fixed && map.keyframes().contains(poses_[i]))
      map.set_pose(poses_[i], problem.poses[i].T_cw);
  }
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (map.points().contains(points_[i])) map.set_position(points_[i], problem.points[i]);
  }
  // Cut short, it cannot tell what is wrong from what it had no time to fit.
  if (!result.aborted) {
    remove_outliers(map, point_sights_, result.outlier, &Keyframe::points);
    remove_outliers(map, line_sights_, result.line_outlier, &Keyframe::lines);
  }
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

}  // namespace ipl_slam
