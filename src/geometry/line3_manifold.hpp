#pragma once

#include <ceres/manifold.h>

#include "geometry/line3.hpp"

namespace ipl_slam {

/// Length of a line as Ceres keeps it: moment x y z (metres), then direction x y z.
inline constexpr int kLineBlockSize = 6;

/// The block of a line, and back. The block holds a line to the last digit: the direction is brought to
/// length 1, and the moment to a right angle with it.
void to_line_block(const Line3& line, double* block);
[[nodiscard]] Line3 from_line_block(const double* block);

/// Tells Ceres how a line block moves in its four degrees of freedom, for an orthonormal frame U = (u1, d,
/// u3) whose second axis is the line's direction:
///
///   line + (a1, a3, b1, b3):  R = exp(a1 u1 + a3 u3),  d <- R d,  n <- R (n + b1 u1 + b3 u3)
///
/// a: radians, turns about the world's origin; b: metres, shifts. To first order these are the steps of the
/// orthonormal representation (Bartoli and Sturm, "Structure-from-motion using lines", CVIU 2005): the same
/// Gauss-Newton step, since steps span the same space. There, n moves in polar coordinates (a turn about d
/// and a change of |n|), which lose one degree of freedom where n = 0; here it moves in the Cartesian
/// coordinates of the same plane, so that a line through the origin, or near it, is a line like any other.
class Line3Manifold final : public ceres::Manifold {
 public:
  [[nodiscard]] int AmbientSize() const override { return kLineBlockSize; }
  [[nodiscard]] int TangentSize() const override { return 4; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

}  // namespace ipl_slam
