#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include <ipl_slam/tracking_state.hpp>

#include "common/ids.hpp"
#include "dynamics/feature_weights.hpp"
#include "features/frame.hpp"
#include "features/line_features.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {

/// How often a landmark should have been and was seen since the last report.
template <class LandmarkId>
struct Sighting {
  LandmarkId landmark;
  int visible = 0, found = 0;
};

/// Where a frame saw a line landmark: undistorted pixels, in the line's direction.
struct SeenLine {
  LineId line;
  Eigen::Vector2d start, end;
  double weight = 1.0;  ///< alpha_l, how much it may say, 0 to 1
};

/// What tracking gives for one frame.
struct TrackedFrame {
  std::shared_ptr<const Frame> frame;
  TrackingState state = TrackingState::kInitializing;
  SE3 T_cw;                     ///< in the world of the local map that was tracked against
  KeyframeId reference;         ///< the keyframe that shares most landmarks; invalid before there is a map
  SE3 T_c_reference;            ///< pose relative to it: stays true when the map is corrected later
  std::vector<PointId> points;  ///< per keypoint: the landmark seen there; invalid = none
  std::vector<SeenLine> lines;  ///< lines that agree with the pose
  int inliers = 0;              ///< matched points that agree with the pose
  FeatureWeights weights;       ///< how much each feature was allowed to say
};

/// A tracked frame on its way into the map.
struct KeyframeCandidate {
  TrackedFrame tracked;
  std::vector<Sighting<PointId>> sightings = {};        ///< since the candidate before
  std::vector<Sighting<LineId>> line_sightings = {};    ///< the same of lines
  std::shared_ptr<const LineFeatures> lines = nullptr;  ///< of the frame; null = not looked for
  FeatureTrust line_trust = {};                         ///< of these lines
};

}  // namespace ipl_slam
