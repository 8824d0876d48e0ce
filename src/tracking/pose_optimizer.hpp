#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "common/options.hpp"
#include "geometry/camera.hpp"
#include "geometry/depth_noise.hpp"
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

struct PoseOptimizerOptions {
  int rounds = 4;
  int iterations = 10;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("rounds", rounds, {1, 20, "count", "rounds of optimise, then sort matches into inliers and outliers"});
    v.number("iterations", iterations, {1, 100, "count", "Gauss-Newton/Levenberg-Marquardt steps per round at most"});
  }
};

struct PoseEstimate {
  SE3 T_cw;
  std::vector<std::uint8_t> inlier;              ///< 1 or 0 per match
  int inliers = 0;
  Matrix6d information = Matrix6d::Zero();       ///< J^T W J at the solution; left perturbation (rho, phi) of T_cw
};

/// Camera pose from matches to known points: Huber-robust reprojection error:
/// sum rho(alpha_p e^T Omega e), paper section 3.5, with measured inverse depth as a third residual where there is one.
class PoseOptimizer {
 public:
  PoseOptimizer(const Camera& camera, const DepthNoiseOptions& noise, const PoseOptimizerOptions& options);

  /// Starts at T_cw. With fewer than 3 usable matches the start value comes back with inliers = 0.
  [[nodiscard]] PoseEstimate optimize(const SE3& T_cw, std::span<const PointMatch> matches) const;

 private:
  Camera camera_;
  DepthNoiseOptions noise_;
  PoseOptimizerOptions options_;
};

}  // namespace ipl_slam
