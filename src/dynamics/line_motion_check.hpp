#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "common/options.hpp"
#include "features/line_features.hpp"
#include "features/line_matcher.hpp"
#include "geometry/camera.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {

/// Settings of the check. Keyframes lie about ten frames apart, in which a walking person's lines move by
/// more than the camera's: the gate around the common motion is wider than the matcher's own. The deviations
/// are above what lines that are still show (half of them have a chi2 below 1.4, normal errors would have
/// 3.4), since they leave room for the error of the pose; max_chi2 is the 99.9 % point of the chi-square
/// distribution with 4 degrees of freedom.
struct LineMotionOptions {
  std::string check = "residual";
  double max_angle = 0.5;
  double still = 1.0;
  double min_weight = 0.1;
  double pixel_sigma = 1.0;
  double inverse_depth_sigma = 0.01;
  double max_chi2 = 18.47;
  LineMatchOptions match{.max_offset = 60.0};

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
    v.number(
        "max_chi2", max_chi2,
        {0.0, 1e6, "1", "residual: squared Mahalanobis distance, of 4 components, above this is motion"});
    v.section("match", match, "matching of the lines");
  }
};

/// theta_avg = (|t1 - t2| + |t1 - t3| + |t2 - t3|) / 3, rad, differences wrapped to [0, pi]: t1, t2, t3 are
/// the angles to the x-axis of the ways that start, middle and end point went from `before` to `now`
/// (undistorted pixels). A way shorter than `still` pixels carries no angle: it differs from no other (paper,
/// section 3.4), nor does one that is no number.
[[nodiscard]] double mean_angle_difference(const LineSegment& before, const LineSegment& now, double still);

/// What is known of the motion of a keyframe's segments.
struct LineMotion {
  std::vector<std::uint8_t> matched;  ///< 1 where the segment was found in the keyframe before
  std::vector<std::uint8_t> dynamic;  ///< 1 where it moved by itself
  std::vector<double> weight;         ///< alpha_l in [0, 1], 0 = dropped; 1 where not matched
};

/// Compares the lines of consecutive keyframes, matched by match_lines.
///
/// "angle" is the paper's check: a line is dynamic where mean_angle_difference exceeds max_angle, its weight
/// is line_weight of it. The camera's own motion is not taken out.
///
/// "residual" carries the earlier line along with the camera and compares it with the one measured, at the
/// end points of the latter: distance across the line (e_l of the paper, section 3.5) and inverse depth, four
/// components. Their covariance follows to first order from the errors of the end points of both segments:
/// pixel_sigma 2^octave across the line, and the covariance of the fitted depth plus inverse_depth_sigma^2.
/// Above max_chi2 the squared Mahalanobis distance is motion, unless another line of the keyframe before that
/// looks like it (descriptor within match.max_distance) was to be expected there: then the match was wrong.
/// With d = sqrt(chi2 / 4) the weight is that of the paper's points, (d_max - d) / (d_max - d_min) in [0, 1],
/// with fixed bounds: d_min = 1, the value of correct residuals, and d_max = sqrt(max_chi2 / 4). A line whose
/// depth is not known in both keyframes, or that would lie behind the camera, counts as not matched.
class LineMotionCheck {
 public:
  LineMotionCheck(const Camera& camera, const LineMotionOptions& options)
      : camera_(camera), options_(options) {}

  /// T_now_before maps the camera frame of the keyframe before to that of the present one; "angle" does not
  /// use it. Everything is still and of weight 1 with `check` off. Throws std::invalid_argument where lines
  /// and descriptors differ in number.
  [[nodiscard]] LineMotion compare(const LineFeatures& before, const LineFeatures& now,
                                   const SE3& T_now_before) const;

 private:
  Camera camera_;
  LineMotionOptions options_;
};

}  // namespace ipl_slam
