#pragma once

#include "geometry/se3.hpp"

namespace ipl_slam {

// Source of both: Sola et al., "A micro Lie theory for state estimation in robotics", 2018.

/// The matrix Ad with T exp(xi) = exp(Ad xi) T.
[[nodiscard]] Matrix6d adjoint(const SE3& T);

/// Inverse of the left Jacobian of SE(3): log(exp(delta) exp(xi)) = xi + J delta to first order in delta, for
/// rotations below 2 pi.
[[nodiscard]] Matrix6d left_jacobian_inverse(const Vector6d& xi);

}  // namespace ipl_slam
