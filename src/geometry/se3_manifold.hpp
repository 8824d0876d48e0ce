#pragma once

#include <ceres/manifold.h>

#include "geometry/se3.hpp"

namespace ipl_slam {

/// Length of a pose as Ceres keeps it: quaternion x y z w, then translation x y z (metres).
inline constexpr int kPoseBlockSize = 7;

/// The block of a pose, and back.
void to_pose_block(const SE3& pose, double* block);
[[nodiscard]] SE3 from_pose_block(const double* block);

/// Tells Ceres how a pose block moves: x + xi = exp(xi) x with xi = (rho, phi) on the left, as everywhere in
/// the project.
class SE3Manifold final : public ceres::Manifold {
 public:
  [[nodiscard]] int AmbientSize() const override { return kPoseBlockSize; }
  [[nodiscard]] int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

}  // namespace ipl_slam
