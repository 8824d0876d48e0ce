#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "common/options.hpp"
#include "features/frame.hpp"
#include "features/matcher.hpp"
#include "features/scale_pyramid.hpp"
#include "geometry/camera.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {

struct RelocalizerOptions {
  int min_matches = 15;
  double ransac_threshold = 3.0;
  int ransac_iterations = 300;
  MatchOptions match;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("min_matches", min_matches,
             {4, 1000, "count", "matches with depth that must agree on one motion"});
    v.number("ransac_threshold", ransac_threshold,
             {0.1, 20.0, "px", "reprojection error a match may have, at pyramid level 0"});
    v.number("ransac_iterations", ransac_iterations, {10, 10000, "count", "samples drawn at most"});
    v.section("match", match, "descriptor match of frame and keyframe");
  }
};

/// Finds a frame's pose without a prediction, from one earlier frame whose pose is known: descriptor matches,
/// then the rigid motion (RANSAC) between the points that both depth images show.
class Relocalizer {
 public:
  /// Its samples depend on the two frames' indices and on `seed`.
  Relocalizer(const Camera& camera, const ScalePyramid& pyramid, const RelocalizerOptions& options,
              std::uint64_t seed = 0);

  /// T_cw of the frame, or nothing. Rough: it may rest on a few points' measured depth. `removed`, if not
  /// empty, has one entry per keypoint of the frame; those not 0 are not used.
  [[nodiscard]] std::optional<SE3> find_pose(const Frame& frame, const Frame& earlier, const SE3& T_earlier_w,
                                             std::span<const std::uint8_t> removed = {}) const;

 private:
  Camera camera_;
  ScalePyramid pyramid_;
  RelocalizerOptions options_;
  std::uint64_t seed_;
};

}  // namespace ipl_slam
