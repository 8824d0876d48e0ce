#pragma once

#include "map/map.hpp"

namespace ipl_slam {

/// Landmarks that were taken out.
struct RemovedLandmarks {
  int points = 0, lines = 0;
};

/// Takes out the landmarks on something that turned out to move: wherever keyframes saw them, it is no longer
/// there. A landmark sits on a region where most of its observations do; one that sits elsewhere only loses
/// its observations in the region, which came from a mask that reached too far.
RemovedLandmarks remove_landmarks_on(Map& map, InstanceId region);

}  // namespace ipl_slam
