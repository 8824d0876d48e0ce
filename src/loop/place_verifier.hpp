#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/options.hpp"
#include "dynamics/feature_weights.hpp"
#include "features/frame.hpp"
#include "features/line_features.hpp"
#include "map/map.hpp"
#include "tracking/pose_optimizer.hpp"
#include "tracking/visibility.hpp"

namespace ipl_slam {

struct PlaceVerifierOptions {
  int min_inliers = 40;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("min_inliers", min_inliers, {6, 10000, "count", "landmarks that must agree on one pose"});
  }
};

/// What is to be placed in the map: a frame, or a keyframe with its lines.
struct PlaceView {
  const Frame& frame;
  FeatureTrust trust = {};              ///< of its keypoints; those of weight 0 are not used
  const LineFeatures* lines = nullptr;  ///< null = not looked for
  FeatureTrust line_trust = {};
};

/// Where a view was found.
struct PlaceMatch {
  KeyframeId keyframe;          ///< the candidate it was compared with
  SE3 T_cw;                     ///< pose of the view in the world of that keyframe's part
  std::vector<PointId> points;  ///< per keypoint: the landmark seen there; invalid = none
  std::vector<LineId> lines;    ///< per segment, the same
  int inliers = 0;              ///< points that agree with the pose
  int line_inliers = 0;
  double found_share = 0.0;  ///< of the landmarks that the pose lets expect, those that were found
};

/// Decides whether a view shows the place of a keyframe, and from where: descriptor matches with the
/// landmarks of the keyframe and those covisible with it, rigid motion or PnP by RANSAC, then a guided search
/// for all their points and lines and the pose they agree on.
class PlaceVerifier {
 public:
  /// Its samples depend on the view's frame index, the keyframe's id and `seed`.
  PlaceVerifier(const Camera& camera, const ScalePyramid& pyramid, const DepthNoiseOptions& noise,
                const PlaceVerifierOptions& options, const PoseOptimizerOptions& pose,
                std::uint64_t seed = 0);

  /// Nothing where too little agrees, or too much of what the pose lets expect is not there.
  [[nodiscard]] std::optional<PlaceMatch> verify(const Map& map, const PlaceView& view,
                                                 KeyframeId candidate) const;

 private:
  Camera camera_;
  PlaceVerifierOptions options_;
};

}  // namespace ipl_slam
