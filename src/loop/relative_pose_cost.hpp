#pragma once

#include <ceres/sized_cost_function.h>

#include "geometry/se3_manifold.hpp"

namespace ipl_slam {

/// The residual of a pose graph's edge (loop/pose_graph.hpp) as Ceres wants it: a function of the pose blocks
/// of T_aw and T_bw (geometry/se3_manifold.hpp). With E = T_aw T_wb T_ab^-1 = exp(e) and left increments,
///
///   exp(xi_a) E             ->  de = J(e) xi_a
///   E exp(-Ad(T_ab) xi_b)   ->  de = -J(e) Ad(E T_ab) xi_b
///
/// where J is the inverse of the left Jacobian of SE(3).
class RelativePoseCost final : public ceres::SizedCostFunction<6, kPoseBlockSize, kPoseBlockSize> {
 public:
  /// `scale`: factor of each component of e.
  RelativePoseCost(const SE3& T_ab, const Vector6d& scale) : T_ba_(T_ab.inverse()), scale_(scale) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  SE3 T_ba_;
  Vector6d scale_;
};

}  // namespace ipl_slam
