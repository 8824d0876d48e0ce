#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "common/options.hpp"
#include "features/line_features.hpp"
#include "features/line_matcher.hpp"
#include "geometry/camera.hpp"
#include "geometry/depth_noise.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {

struct LineMotionOptions {
  std::string check = "residual";
  double max_angle = 0.5;
  double still = 1.0;
  double min_weight = 0.1;
  double pixel_sigma = 1.0;
  double inverse_depth_sigma = 0.01;
  double max_chi2 = 13.3;
  LineMatchOptions match;

  template <class Visitor>
  void visit(Visitor& v) {
    v.choice("check", check, {"off", "angle", "residual"},
             "lines of consecutive keyframes: angle = the angles between the ways of start, middle and end "
             "(paper); residual = the earlier line, carried along with the camera, against the one measured");
    v.number("max_angle", max_angle,
             {0.0, 3.15, "rad", "mean difference of the angles above this is motion"});
    v.number("still", still, {0.0, 20.0, "px", "a shorter way has no angle: it counts as still"});
    v.number("min_weight", min_weight, {0.0, 1.0, "1", "a line with a smaller weight is dropped"});
    v.number("pixel_sigma", pixel_sigma,
             {0.01, 20.0, "px", "residual: standard deviation of an end point across its line on octave 0"});
    v.number("inverse_depth_sigma", inverse_depth_sigma,
             {0.0, 1.0, "1/m", "residual: deviation of an end's inverse depth beyond that of its fit"});
    v.number("max_chi2", max_chi2,
             {0.0, 1e6, "1", "residual: squared Mahalanobis distance, of 4 components, above this is motion"});
    v.section("match", match, "matching of the lines");
  }
};

/// theta_avg = (|t1 - t2| + |t1 - t3| + |t2 - t3|) / 3, rad, differences wrapped to [0, pi]: t1, t2, t3 are
/// the angles to the x-axis of the ways that start, middle and end point went from `before` to `now`
/// (undistorted pixels). A way shorter than `still` pixels carries no angle: it differs from no other (paper,
/// section 3.4).
[[nodiscard]] double mean_angle_difference(const LineSegment& before, const LineSegment& now, double still);

/// What is known of the motion of a keyframe's segments.
struct LineMotion {
  std::vector<std::uint8_t> matched;  ///< 1 where the segment was found in the keyframe before
  std::vector<std::uint8_t> dynamic;  ///< 1 where it moved by itself
  std::vector<double> weight;         ///< alpha_l in [0, 1], 0 = dropped; 1 where not matched
};

/// Compares the lines of consecutive keyframes.
class LineMotionCheck {
 public:
  LineMotionCheck(const Camera& camera, const DepthNoiseOptions& noise, const LineMotionOptions& options);

  /// T_now_before maps the camera frame of the keyframe before to that of the present one. Everything is
  /// still and of weight 1 with `check` off.
  [[nodiscard]] LineMotion compare(const LineFeatures& before, const LineFeatures& now,
                                   const SE3& T_now_before) const;

 private:
  Camera camera_;
  DepthNoiseOptions noise_;
  LineMotionOptions options_;
};

}  // namespace ipl_slam
