#pragma once

#include <vector>

#include "map/map.hpp"

namespace ipl_slam {

/// The landmarks of a place, each kind in order of id.
struct LandmarkGroup {
  std::vector<PointId> points;
  std::vector<LineId> lines;
};

/// What a keyframe sees, and the `neighbours` keyframes that share most landmarks with it.
[[nodiscard]] LandmarkGroup landmarks_around(const Map& map, KeyframeId id, int neighbours);

}  // namespace ipl_slam
