#include "mapping/culling.hpp"

namespace ipl_slam {
namespace {

const Store<PointId, Point>& landmarks(const Map& map, PointId) {
  return map.points();
}
const Store<LineId, Line>& landmarks(const Map& map, LineId) {
  return map.lines();
}

// Size of the smallest detail the feature shows: pyramid level of a keypoint, octave of a segment.
int coarseness(const Keyframe& keyframe, PointId, std::size_t keypoint) {
  return keyframe.frame->features.keypoints[keypoint].level;
}
int coarseness(const Keyframe& keyframe, LineId, std::size_t segment) {
  return keyframe.line_features->segments[segment].octave;
}

// Whether enough other keyframes see what this feature sees, at most one level or octave coarser.
template <class LandmarkId>
bool seen_well_by_others(const Map& map, KeyframeId self, std::size_t feature, LandmarkId id, int observers) {
  const int own = coarseness(map.keyframes()[self], id, feature);
  int count = 0;
  for (const Observation& o : landmarks(map, id)[id].observations) {
    if (o.keyframe == self) continue;
    count += coarseness(map.keyframes()[o.keyframe], id, o.feature) <= own + 1 ? 1 : 0;
    if (count >= observers) return true;
  }
  return false;
}

bool redundant(const Map& map, KeyframeId id, const CullingOptions& options) {
  int all = 0, seen_well = 0;
  const auto count = [&](const auto& owners) {
    for (std::size_t f = 0; f < owners.size(); ++f) {
      if (!owners[f].valid()) continue;
      ++all;
      seen_well += seen_well_by_others(map, id, f, owners[f], options.redundant_observers) ? 1 : 0;
    }
  };
  count(map.keyframes()[id].points);
  count(map.keyframes()[id].lines);
  return seen_well > options.redundant_share * all;
}

}  // namespace

template <class LandmarkId>
void LandmarkCulling<LandmarkId>::cull(Map& map) {
  std::vector<LandmarkId> still_recent;
  for (const LandmarkId id : recent_) {
    if (!landmarks(map, id).contains(id)) continue;
    const auto& landmark = landmarks(map, id)[id];
    const auto age = static_cast<int>(map.newest_keyframe().value - landmark.first_keyframe.value);
    const bool rarely_found = landmark.found < options_.min_found_ratio * landmark.visible;
    const bool over = age >= options_.probation;
    if (rarely_found ||
        (over && static_cast<int>(landmark.observations.size()) < options_.min_observations)) {
      map.remove(id);
    } else if (!over) {
      still_recent.push_back(id);
    }
  }
  recent_ = std::move(still_recent);
}

template class LandmarkCulling<PointId>;
template class LandmarkCulling<LineId>;

void cull_keyframes(Map& map, KeyframeId centre, const CullingOptions& options) {
  for (const Covisible& neighbour : map.covisible(centre)) {
    const KeyframeId id = neighbour.keyframe;
    if (map.is_anchor(id) || id == map.newest_keyframe()) continue;
    if (redundant(map, id, options)) map.remove_keyframe(id);
  }
}

}  // namespace ipl_slam
