#include "mapping/landmark_fusion.hpp"

#include <algorithm>
#include <set>

#include "geometry/robust.hpp"
#include "mapping/seen_landmarks.hpp"

namespace ipl_slam {

void LandmarkFusion::fuse_around(Map& map, KeyframeId id) const {
  std::set<KeyframeId> neighbours;
  const std::vector<Covisible> first = map.covisible(id);
  for (std::size_t i = 0; i < first.size() && i < static_cast<std::size_t>(options_.neighbours); ++i) {
    neighbours.insert(first[i].keyframe);
    const std::vector<Covisible> second = map.covisible(first[i].keyframe);
    for (std::size_t j = 0; j < second.size() && j < static_cast<std::size_t>(options_.second_neighbours);
         ++j) {
      neighbours.insert(second[j].keyframe);
    }
  }
  neighbours.erase(id);

  for (const KeyframeId neighbour : neighbours) {
    const std::vector<PointId> own =
        seen_landmarks(map, {id}, &Keyframe::points);  // fusion may have changed them
    fuse_into(map, neighbour, own);
  }
  fuse_into(map, id, seen_landmarks(map, neighbours, &Keyframe::points));
}

void LandmarkFusion::fuse_into(Map& map, KeyframeId target, std::span<const PointId> candidates) const {
  const SE3 T_cw = map.keyframes()[target].T_cw;
  const std::shared_ptr<const Frame> frame = map.keyframes()[target].frame;
  std::vector<ProjectedPoint> windows;
  std::vector<PointId> projected;
  for (const PointId id : candidates) {
    if (map.observes(target, id)) continue;
    if (const auto window = visibility_.project(T_cw, map.points()[id], options_.radius)) {
      windows.push_back(*window);
      projected.push_back(id);
    }
  }
  const std::vector<int> found = match_projected(frame->features, frame->grid, windows, options_.match);

  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i] < 0) continue;
    const PointId point = map.resolve(projected[i]);  // an earlier turn of this loop may have fused it
    const auto keypoint = static_cast<std::uint32_t>(found[i]);
    if (!point.valid() || map.observes(target, point)) continue;
    if (!agrees(map, T_cw, point, frame->features.keypoints[keypoint])) continue;
    const PointId there = map.keyframes()[target].points[keypoint];
    if (!there.valid()) {
      map.add_observation(point, target, keypoint);
      map.refresh(point);
    } else if (there != point) {
      const bool keep_there =
          map.points()[there].observations.size() > map.points()[point].observations.size();
      keep_there ? map.fuse(there, point) : map.fuse(point, there);
    }
  }
}

bool LandmarkFusion::agrees(const Map& map, const SE3& T_cw, PointId point, const Keypoint& keypoint) const {
  const Eigen::Vector3d p_c = T_cw * map.points()[point].position;
  if (p_c.z() <= 0.0) return false;
  const double sigma2 = map.pyramid().sigma2(keypoint.level);
  const double chi2 = (keypoint.undistorted.cast<double>() - camera_.project(p_c)).squaredNorm() / sigma2;
  if (keypoint.depth <= 0.0F) return chi2 < kChi2For2Dof;
  const double depth_error = (1.0 / keypoint.depth - 1.0 / p_c.z()) / noise_.inverse_depth_sigma;
  return chi2 + depth_error * depth_error < kChi2For3Dof;
}

}  // namespace ipl_slam
