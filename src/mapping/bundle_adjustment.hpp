#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "common/options.hpp"
#include "geometry/camera.hpp"
#include "geometry/depth_noise.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {

/// Poses and points with the observations that tie them together, by index. No ids: the caller keeps the
/// tables.
struct BundleProblem {
  struct Pose {
    SE3 T_cw;
    bool fixed = false;
  };
  struct Observation {
    std::uint32_t pose = 0, point = 0;             ///< indices into poses and points
    Eigen::Vector2d uv = Eigen::Vector2d::Zero();  ///< undistorted pixel
    double depth = 0.0;                            ///< measured, m; <= 0 = none
    double sigma2 = 1.0;                           ///< variance of uv, pixel^2
    double weight = 1.0;                           ///< in (0, 1]
  };
  std::vector<Pose> poses;
  std::vector<Eigen::Vector3d> points;  ///< world frame, m
  std::vector<Observation> observations;
};

struct BundleOptions {
  int robust_iterations = 5;
  int final_iterations = 10;
  int threads = 1;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("robust_iterations", robust_iterations,
             {1, 100, "count", "steps with the Huber kernel, before outliers go"});
    v.number("final_iterations", final_iterations, {0, 100, "count", "steps on the inliers"});
    v.number("threads", threads,
             {1, 64, "count", "threads that evaluate residuals; the result does not depend on it"});
  }
};

struct BundleResult {
  std::vector<std::uint8_t>
      outlier;  ///< per observation, 1 = fails the chi-square test (or behind the camera) at the end
  double initial_cost = 0.0, final_cost = 0.0;
  int iterations = 0;
  bool aborted = false;  ///< `abort` was raised: the problem holds the best state reached so far
};

/// Optimises poses and points in place (Ceres, analytic Jacobians). `abort`, when not null, is polled between
/// steps.
BundleResult adjust_bundle(BundleProblem& problem, const Camera& camera, const DepthNoiseOptions& noise,
                           const BundleOptions& options, const std::atomic<bool>* abort = nullptr);

}  // namespace ipl_slam
