#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "common/options.hpp"
#include "features/features.hpp"
#include "features/scale_pyramid.hpp"
#include "geometry/camera.hpp"
#include "geometry/depth_noise.hpp"
#include "geometry/line3.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {

/// A map point and where the frame saw it.
struct PointMatch {
  Eigen::Vector3d point_w = Eigen::Vector3d::Zero();  ///< world frame, m
  Eigen::Vector2d uv = Eigen::Vector2d::Zero();       ///< undistorted pixel
  double depth = 0.0;                                 ///< measured depth, m; <= 0 = none
  double sigma2 = 1.0;                                ///< variance of uv, pixel^2 (of the pyramid level)
  double weight = 1.0;                                ///< alpha_p in [0, 1]; 0 takes the match out
};

/// A map point that a keypoint shows.
[[nodiscard]] inline PointMatch point_match(const Eigen::Vector3d& point_w, const Keypoint& keypoint,
                                            const ScalePyramid& pyramid, double weight) {
  return {point_w, keypoint.undistorted.cast<double>(), keypoint.depth, pyramid.sigma2(keypoint.level),
          weight};
}

/// A line of the map and where the frame saw it.
struct LineMatch {
  Line3 line_w;                                     ///< world frame
  Eigen::Vector2d start = Eigen::Vector2d::Zero();  ///< observed end points, undistorted pixels
  Eigen::Vector2d end = Eigen::Vector2d::Zero();
  double sigma2 = 1.0;  ///< variance of an end point across the line, pixel^2
  /// Measured inverse depth at the end points, 1/m; <= 0 = none.
  double inverse_start = 0.0, inverse_end = 0.0;
  /// Their standard deviations, 1/m; 0 = DepthNoiseOptions::inverse_depth_sigma.
  double sigma_start = 0.0, sigma_end = 0.0;
  double weight = 1.0;  ///< alpha_l in [0, 1]; 0 takes the match out
};

struct PoseOptimizerOptions {
  int rounds = 4;
  int robust_rounds = 2;
  int iterations = 10;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("rounds", rounds,
             {1, 20, "count", "rounds of optimise, then sort all matches into inliers and outliers"});
    v.number("robust_rounds", robust_rounds,
             {0, 20, "count", "first rounds that use the Huber kernel; the later ones trust the sorting"});
    v.number("iterations", iterations, {1, 100, "count", "Levenberg-Marquardt steps per round at most"});
  }
};

struct PoseEstimate {
  SE3 T_cw;
  std::vector<std::uint8_t> inlier;  ///< 1 or 0 per point
  int inliers = 0;
  std::vector<std::uint8_t> line_inlier;  ///< 1 or 0 per line
  int line_inliers = 0;
  /// J^T W J over the inliers at the solution, W = weight x inverse variance; left perturbation (rho, phi) of
  /// T_cw, so rows and columns in 1/m and 1/rad. Its inverse is the pose's covariance where it has one
  /// (inliers that see all six directions); it is zero where there are no inliers of either kind.
  Matrix6d information = Matrix6d::Zero();
};

/// Camera pose from matches to known points and lines: Levenberg-Marquardt on the Huber-robust reprojection
/// error sum rho(alpha_p e_p^T Omega_p e_p) + sum rho(alpha_l e_l^T Omega_l e_l), paper section 3.5. e_p has
/// measured inverse depth as a third component where there is one (geometry/reprojection.hpp); e_l holds the
/// distances of both observed end points from the projected line, and the measured inverse depth at each end
/// point that has one (geometry/line_reprojection.hpp).
///
/// After each round every match is sorted anew: an inlier's unweighted error e^T Omega e stays below the 95 %
/// chi-square point. alpha says how much a match may pull, not how far off it may be, so it does not enter
/// the sorting. A match that cannot be used (weight 0, behind the camera, a line seen end-on, numbers not
/// finite or without sense) is an outlier. The result does not depend on whether the processor has AVX2.
class PoseOptimizer {
 public:
  PoseOptimizer(const Camera& camera, const DepthNoiseOptions& noise, const PoseOptimizerOptions& options);

  /// Starts at T_cw. With fewer than 3 usable matches, points and lines together, at the start or after a
  /// round, the start value comes back without inliers.
  [[nodiscard]] PoseEstimate optimize(const SE3& T_cw, std::span<const PointMatch> points,
                                      std::span<const LineMatch> lines = {}) const;

 private:
  Camera camera_;
  DepthNoiseOptions noise_;
  PoseOptimizerOptions options_;
};

/// Standard deviation in the direction a pose is least certain of, m or rad, from PoseEstimate::information;
/// infinite where one is open.
[[nodiscard]] double largest_deviation(const Matrix6d& information);

}  // namespace ipl_slam
