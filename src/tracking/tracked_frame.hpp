#pragma once

#include <memory>
#include <vector>

#include <ipl_slam/tracking_state.hpp>

#include "common/ids.hpp"
#include "features/frame.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {

/// How often a landmark should have been and was seen since the last report.
struct Sighting {
  PointId point;
  int visible = 0, found = 0;
};

/// What tracking gives for one frame.
struct TrackedFrame {
  std::shared_ptr<const Frame> frame;
  TrackingState state = TrackingState::kInitializing;
  SE3 T_cw;                     ///< in the world of the local map that was tracked against
  KeyframeId reference;         ///< the keyframe that shares most landmarks; invalid before there is a map
  SE3 T_c_reference;            ///< pose relative to it: stays true when the map is corrected later
  std::vector<PointId> points;  ///< per keypoint: the landmark seen there; invalid = none
  int inliers = 0;              ///< matched landmarks that agree with the pose
};

/// A tracked frame on its way into the map.
struct KeyframeCandidate {
  TrackedFrame tracked;
  std::vector<Sighting> sightings;  ///< since the candidate before
};

}  // namespace ipl_slam
