#pragma once

#include "map/map.hpp"

namespace ipl_slam {

/// The part of the map that a landmark (Point or Line) belongs to: that of all keyframes that see it.
template <class Landmark>
[[nodiscard]] PartId part_of(const Map& map, const Landmark& landmark) {
  return map.keyframes()[landmark.observations.front().keyframe].part;
}

}  // namespace ipl_slam
