#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "common/options.hpp"
#include "geometry/camera.hpp"
#include "geometry/depth_noise.hpp"
#include "geometry/line3.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {

/// Poses, points and lines with the observations that tie them together, by index. No ids: the caller keeps
/// the tables.
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
  struct LineObservation {
    std::uint32_t pose = 0, line = 0;                 ///< indices into poses and lines
    Eigen::Vector2d start = Eigen::Vector2d::Zero();  ///< end points of the segment, undistorted pixels
    Eigen::Vector2d end = Eigen::Vector2d::Zero();
    double sigma2 = 1.0;  ///< variance of an end point across the line, pixel^2
    /// Measured inverse depth at the end points, 1/m; <= 0 = none.
    double inverse_start = 0.0, inverse_end = 0.0;
    /// Their standard deviations, 1/m; 0 = DepthNoiseOptions::inverse_depth_sigma.
    double sigma_start = 0.0, sigma_end = 0.0;
    double weight = 1.0;  ///< in (0, 1]
  };
  std::vector<Pose> poses;
  std::vector<Eigen::Vector3d> points;  ///< world frame, m
  std::vector<Observation> observations;
  std::vector<Line3> lines;  ///< world frame
  std::vector<LineObservation> line_observations;
};

struct BundleOptions {
  int robust_iterations = 5;
  int final_iterations = 10;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("robust_iterations", robust_iterations,
             {1, 100, "count", "steps at most before outliers are taken out"});
    v.number("final_iterations", final_iterations,
             {0, 100, "count", "steps at most on the inliers; 0 ends after the first phase"});
  }
};

struct BundleResult {
  /// Per observation, 1 = fails the 95 % chi-square test at the end, lies behind the camera, or could not be
  /// used (not finite, weight or variance not above 0, behind the camera at the start). The test does not
  /// look at the weight, which says how much an observation may pull and not how far off it may be.
  std::vector<std::uint8_t> outlier;
  /// The same per line observation, in as many degrees of freedom as it has measurements: 2 for its distances
  /// from the line and one for each measured inverse depth. One that could not be used has, at the start, a
  /// line without an image (project_line), or behind the camera at an end point.
  std::vector<std::uint8_t> line_outlier;
  /// Half the sum of rho(weight x chi-square), Huber, over all observations that could be used, outliers
  /// among them: the two can be compared.
  double initial_cost = 0.0, final_cost = 0.0;
  int iterations = 0;    ///< steps tried in both phases
  bool aborted = false;  ///< `abort` was raised: the problem holds the best state reached so far
};

/// Optimises poses, points and lines in place: Ceres, Schur complement, analytic Jacobians
/// (geometry/reprojection.hpp, geometry/line_reprojection.hpp). Two phases, both with the Huber kernel: all
/// observations, then those that pass the chi-square test after the first. Poses, points and lines without an
/// inlier at the end keep the value they came with, and so do fixed poses, to the last byte; where no pose is
/// fixed the first is, since observations cannot tell where the world is.
///
/// What neither depth nor parallax determines (a line that one camera sees, say) does not disturb the rest,
/// but noise may carry it far along the direction that is open: judge it by its parallax before it is
/// believed.
///
/// `abort`, when not null, is polled between steps; it may be raised from another thread. Runs on the calling
/// thread alone: Ceres' own threads make the last digits of the result depend on their timing. Throws
/// std::out_of_range for an observation whose index lies outside the poses, points or lines.
BundleResult adjust_bundle(BundleProblem& problem, const Camera& camera, const DepthNoiseOptions& noise,
                           const BundleOptions& options, const std::atomic<bool>* abort = nullptr);

}  // namespace ipl_slam
