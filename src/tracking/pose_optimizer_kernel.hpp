#pragma once

#include "geometry/camera.hpp"
#include "geometry/se3.hpp"
#include "tracking/pose_optimizer_lanes.hpp"

// The inner loop of the pose optimiser: residuals, robust weights and normal equations of all points, four at
// a time.

namespace ipl_slam::pose_kernel {

/// What the table holds per match.
enum Field : std::size_t {
  kX,             ///< point in the world, m
  kY,             //
  kZ,             //
  kU,             ///< undistorted pixel
  kV,             //
  kInverseDepth,  ///< measured, 1/m
  kPixelInfo,     ///< 1 / variance of u and of v, 1/pixel^2
  kDepthInfo,     ///< 1 / variance of the inverse depth, m^2; 0 = no depth measured
  kHuber,         ///< where Huber's kernel turns linear, standard deviations
  kWeight,        ///< alpha_p; 0 = takes no part
  kChi2,          ///< output of evaluate()
  kFields
};

using MatchTable = LaneTable<Field, kFields>;

/// Evaluates all matches at T_cw: sums the normal equations, weighted by kWeight and, if `robust`, Huber's
/// kernel, and stores each match's unweighted chi-square (pixels and inverse depth) in kChi2. Runs on AVX2
/// where the processor has it. The order of additions is fixed, four partial sums, so that both versions give
/// the same bits.
void evaluate(const Camera& camera, const SE3& T_cw, bool robust, MatchTable& table, Normal& out);

/// The version for processors without AVX2.
void evaluate_portable(const Camera& camera, const SE3& T_cw, bool robust, MatchTable& table, Normal& out);

}  // namespace ipl_slam::pose_kernel
