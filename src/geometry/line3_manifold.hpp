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

/// Tells Ceres how a line block moves in its four degrees of freedom, in an orthonormal frame U = (u1, d, u3)
/// whose second axis is the line's direction. With p its point nearest to the world's origin:
///
///   line + (a1, a3, b1, b3) = the line through p + b1 u1 + b3 u3 along d + a1 u1 + a3 u3
///
/// a: tangents of angles; b: metres. To first order these are the steps of the orthonormal representation
/// (Bartoli and Sturm, "Structure-from-motion using lines", CVIU 2005), so a Gauss-Newton step is the same.
/// Two things differ in what a step of finite length does. The representation turns a line about the origin,
/// and its observed stretch leaves the tangent as the square of the angle times its distance from there; here
/// every point p + s d of the line moves in proportion to the step. And it takes n in polar coordinates (a
/// turn about d and a change of |n|), which lose a degree of freedom at n = 0; here a line through the origin
/// is a line like any other.
class Line3Manifold final : public ceres::Manifold {
 public:
  [[nodiscard]] int AmbientSize() const override { return kLineBlockSize; }
  [[nodiscard]] int TangentSize() const override { return 4; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  /// False where the directions are a right angle or more apart: no step leads there.
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

}  // namespace ipl_slam
