#pragma once

#include <optional>

#include "common/options.hpp"
#include "features/matcher.hpp"
#include "geometry/camera.hpp"
#include "map/local_map.hpp"

namespace ipl_slam {

struct RelocalizerOptions {
  int max_keyframes = 8;
  int min_matches = 15;
  double ransac_threshold = 3.0;
  int ransac_iterations = 300;
  MatchOptions match;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("max_keyframes", max_keyframes,
             {1, 1000, "count", "keyframes compared with a frame that lost its place"});
    v.number("min_matches", min_matches,
             {4, 1000, "count", "matches with depth that must agree on one motion"});
    v.number("ransac_threshold", ransac_threshold,
             {0.1, 20.0, "px", "reprojection error a match may have, at pyramid level 0"});
    v.number("ransac_iterations", ransac_iterations, {10, 10000, "count", "samples drawn at most"});
    v.section("match", match, "descriptor match of frame and keyframe");
  }
};

/// Finds a frame's pose without a prediction, from one keyframe: descriptor matches, then the rigid motion
/// (RANSAC) between the points that both depth images show.
class Relocalizer {
 public:
  Relocalizer(const Camera& camera, const ScalePyramid& pyramid, const RelocalizerOptions& options);

  /// T_cw of the frame, or nothing. Keyframes nearest to T_cw_guess are tried first.
  [[nodiscard]] std::optional<SE3> find_pose(const Frame& frame, const LocalMap& map,
                                             const SE3& T_cw_guess) const;
  /// T_cw of the frame from one earlier frame whose pose is known, or nothing.
  [[nodiscard]] std::optional<SE3> find_pose(const Frame& frame, const Frame& earlier,
                                             const SE3& T_earlier_w) const;

 private:
  Camera camera_;
  ScalePyramid pyramid_;
  RelocalizerOptions options_;
};

}  // namespace ipl_slam
