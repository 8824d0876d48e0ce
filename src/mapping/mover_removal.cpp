#include "mapping/mover_removal.hpp"

#include <set>

namespace ipl_slam {
namespace {

InstanceId region_of(const Map& map, PointId, const Observation& o) {
  return map.keyframes()[o.keyframe].point_trust.region(o.feature);
}
InstanceId region_of(const Map& map, LineId, const Observation& o) {
  return map.keyframes()[o.keyframe].line_trust.region(o.feature);
}

template <class LandmarkId>
int remove_on(Map& map, InstanceId region, const std::set<LandmarkId>& candidates,
              const std::vector<Observation>& (*observations_of)(const Map&, LandmarkId)) {
  int removed = 0;
  for (const LandmarkId id : candidates) {
    const std::vector<Observation> observations = observations_of(map, id);
    std::vector<KeyframeId> inside;
    for (const Observation& o : observations) {
      if (region_of(map, id, o) == region) inside.push_back(o.keyframe);
    }
    if (2 * inside.size() > observations.size()) {
      map.remove(id);
      ++removed;
    } else {
      for (const KeyframeId keyframe : inside) map.remove_observation(id, keyframe);
      map.refresh(id);
    }
  }
  return removed;
}

// The landmarks of one kind that any keyframe sees in the region.
template <class LandmarkId>
std::set<LandmarkId> seen_in(const Map& map, InstanceId region, std::vector<LandmarkId> Keyframe::*landmarks,
                             FeatureTrust Keyframe::*trust) {
  std::set<LandmarkId> seen;
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    const std::vector<InstanceId>& regions = (keyframe.*trust).regions;
    for (std::size_t f = 0; f < regions.size(); ++f) {
      const LandmarkId landmark = (keyframe.*landmarks)[f];
      if (regions[f] == region && landmark.valid()) seen.insert(landmark);
    }
  });
  return seen;
}

}  // namespace

RemovedLandmarks remove_landmarks_on(Map& map, InstanceId region) {
  const auto points = seen_in(map, region, &Keyframe::points, &Keyframe::point_trust);
  const auto lines = seen_in(map, region, &Keyframe::lines, &Keyframe::line_trust);
  return {remove_on<PointId>(
              map, region, points,
              [](const Map& m, PointId id) -> const auto& { return m.points()[id].observations; }),
          remove_on<LineId>(
              map, region, lines,
              [](const Map& m, LineId id) -> const auto& { return m.lines()[id].observations; })};
}

}  // namespace ipl_slam
