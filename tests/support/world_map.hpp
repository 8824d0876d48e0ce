#pragma once

#include <vector>

#include "map/local_map.hpp"
#include "support/synthetic_world.hpp"

namespace ipl_slam::test {

/// A map of a synthetic world with perfect points.
class WorldMap {
 public:
  explicit WorldMap(const SyntheticWorld& world) : world_(world), point_of_(world.size()) {}

  /// Adds a view as a keyframe at its true pose. It observes the points it shows; those that the map lacks
  /// are made.
  KeyframeId add(const View& view) {
    const KeyframeId id = map.add_keyframe(view.frame, view.T_cw);
    for (std::uint32_t k = 0; k < view.sources.size(); ++k) {
      PointId& point = point_of_[view.sources[k]];
      if (point.valid()) {
        map.add_observation(point, id, k);
        map.refresh(point);
      } else {
        point = map.add_point(world_.position(view.sources[k]), id, k);
      }
    }
    return id;
  }
  [[nodiscard]] PointId point_of(std::uint32_t source) const { return point_of_[source]; }
  [[nodiscard]] std::shared_ptr<const LocalMap> snapshot() const {
    return std::make_shared<const LocalMap>(build_local_map(map, map.newest_keyframe(), {}));
  }

  Map map{kTestPyramid};

 private:
  const SyntheticWorld& world_;
  std::vector<PointId> point_of_;
};

}  // namespace ipl_slam::test
