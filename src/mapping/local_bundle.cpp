#include "mapping/local_bundle.hpp"

#include <algorithm>
#include <map>
#include <set>

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

std::set<PointId> points_of(const Map& map, const std::set<KeyframeId>& keyframes) {
  std::set<PointId> points;
  for (const KeyframeId id : keyframes) {
    for (const PointId point : map.keyframes()[id].points) {
      if (point.valid()) points.insert(point);
    }
  }
  return points;
}

// Of the other keyframes that see the points, those that see most of them.
std::set<KeyframeId> choose_fixed_keyframes(const Map& map, const std::set<KeyframeId>& free,
                                            const std::set<PointId>& points, int limit) {
  std::map<KeyframeId, int> shared;
  for (const PointId point : points) {
    for (const PointObservation& o : map.points()[point].observations) {
      if (!free.contains(o.keyframe)) ++shared[o.keyframe];
    }
  }
  std::vector<std::pair<int, KeyframeId>> order;
  for (const auto& [id, count] : shared) order.emplace_back(-count, id);
  std::sort(order.begin(), order.end());
  std::set<KeyframeId> chosen;
  for (const auto& [count, id] : order) {
    if (static_cast<int>(chosen.size()) >= limit) break;
    chosen.insert(id);
  }
  return chosen;
}

}  // namespace

void adjust_local_bundle(Map& map, KeyframeId centre, const Camera& camera, const DepthNoiseOptions& noise,
                         const LocalBundleOptions& options, const std::atomic<bool>* abort) {
  const std::set<KeyframeId> free = choose_free_keyframes(map, centre, options);
  const std::set<PointId> points = points_of(map, free);
  const std::set<KeyframeId> fixed = choose_fixed_keyframes(map, free, points, options.max_fixed_keyframes);

  BundleProblem problem;
  std::vector<KeyframeId> pose_ids;
  std::map<KeyframeId, std::uint32_t> pose_index;
  const auto add_pose = [&](KeyframeId id, bool is_fixed) {
    pose_index[id] = static_cast<std::uint32_t>(pose_ids.size());
    pose_ids.push_back(id);
    problem.poses.push_back({map.keyframes()[id].T_cw, is_fixed});
  };
  // The first keyframe holds the world frame; without fixed neighbours the oldest of the window does.
  for (const KeyframeId id : free) add_pose(id, id.value == 0 || (fixed.empty() && id == *free.begin()));
  for (const KeyframeId id : fixed) add_pose(id, true);

  std::vector<PointId> point_ids(points.begin(), points.end());
  std::vector<std::pair<PointId, KeyframeId>> owners;
  for (std::uint32_t i = 0; i < point_ids.size(); ++i) {
    const Point& point = map.points()[point_ids[i]];
    problem.points.push_back(point.position);
    for (const PointObservation& o : point.observations) {
      const auto pose = pose_index.find(o.keyframe);
      if (pose == pose_index.end()) continue;
      const Keypoint& keypoint = map.keyframes()[o.keyframe].frame->features.keypoints[o.keypoint];
      problem.observations.push_back({pose->second, i, keypoint.undistorted.cast<double>(), keypoint.depth,
                                      map.pyramid().sigma2(keypoint.level), 1.0});
      owners.emplace_back(point_ids[i], o.keyframe);
    }
  }

  const BundleResult result = adjust_bundle(problem, camera, noise, options.solver, abort);
  for (std::size_t i = 0; i < pose_ids.size(); ++i) {
    if (!problem.poses[i].fixed) map.set_pose(pose_ids[i], problem.poses[i].T_cw);
  }
  for (std::size_t i = 0; i < point_ids.size(); ++i) map.set_position(point_ids[i], problem.points[i]);
  // Cut short, it cannot tell what is wrong from what it had no time to fit.
  for (std::size_t i = 0; i < owners.size() && !result.aborted; ++i) {
    const auto& [point, keyframe] = owners[i];
    if (result.outlier[i] && map.points().contains(point)) map.remove_observation(point, keyframe);
  }
  for (const PointId id : point_ids) {
    if (map.points().contains(id)) map.refresh(id);
  }
}

}  // namespace ipl_slam
