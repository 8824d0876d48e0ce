#include "mapping/culling.hpp"

namespace ipl_slam {
namespace {

// Whether enough other keyframes see what this keypoint sees, at most one level of the pyramid coarser.
bool seen_well_by_others(const Map& map, KeyframeId self, std::size_t keypoint, PointId id, int observers) {
  const int level = map.keyframes()[self].frame->features.keypoints[keypoint].level;
  int count = 0;
  for (const PointObservation& o : map.points()[id].observations) {
    if (o.keyframe == self) continue;
    count += map.keyframes()[o.keyframe].frame->features.keypoints[o.keypoint].level <= level + 1 ? 1 : 0;
    if (count >= observers) return true;
  }
  return false;
}

bool redundant(const Map& map, KeyframeId id, const CullingOptions& options) {
  int points = 0, seen_well = 0;
  const Keyframe& keyframe = map.keyframes()[id];
  for (std::size_t k = 0; k < keyframe.points.size(); ++k) {
    if (!keyframe.points[k].valid()) continue;
    ++points;
    seen_well += seen_well_by_others(map, id, k, keyframe.points[k], options.redundant_observers) ? 1 : 0;
  }
  return seen_well > options.redundant_share * points;
}

}  // namespace

void LandmarkCulling::cull(Map& map) {
  std::vector<PointId> still_recent;
  for (const PointId id : recent_) {
    if (!map.points().contains(id)) continue;
    const Point& point = map.points()[id];
    const auto age = static_cast<int>(map.newest_keyframe().value - point.first_keyframe.value);
    const bool rarely_found = point.found < options_.min_found_ratio * point.visible;
    const bool over = age >= options_.probation;
    if (rarely_found || (over && static_cast<int>(point.observations.size()) < options_.min_observations)) {
      map.remove_point(id);
    } else if (!over) {
      still_recent.push_back(id);
    }
  }
  recent_ = std::move(still_recent);
}

void cull_keyframes(Map& map, KeyframeId centre, const CullingOptions& options) {
  for (const Covisible& neighbour : map.covisible(centre)) {
    const KeyframeId id = neighbour.keyframe;
    if (id.value == 0 || id == map.newest_keyframe()) continue;
    if (redundant(map, id, options)) map.remove_keyframe(id);
  }
}

}  // namespace ipl_slam
