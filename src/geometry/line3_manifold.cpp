#include "geometry/line3_manifold.hpp"

namespace ipl_slam {
namespace {

// The axes u1 and u3 beside the direction d. Which ones does not matter, as long as a line always has the
// same.
struct Axes {
  Eigen::Vector3d u1, u3;

  explicit Axes(const Eigen::Vector3d& d) : u1(d.unitOrthogonal()), u3(u1.cross(d)) {}
};

}  // namespace

void to_line_block(const Line3& line, double* block) {
  Eigen::Map<Eigen::Vector3d> n(block), d(block + 3);
  d = line.direction.normalized();
  n = line.moment - d.dot(line.moment) * d;
}

Line3 from_line_block(const double* block) {
  return {Eigen::Vector3d(block[0], block[1], block[2]), Eigen::Vector3d(block[3], block[4], block[5])};
}

bool Line3Manifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  const Line3 line = from_line_block(x);
  const Axes axes(line.direction);
  const Eigen::Vector3d d = (line.direction + delta[0] * axes.u1 + delta[1] * axes.u3).normalized();
  const Eigen::Vector3d p = line.nearest_to_origin() + delta[2] * axes.u1 + delta[3] * axes.u3;
  to_line_block({p.cross(d), d}, x_plus_delta);
  return true;
}

bool Line3Manifold::PlusJacobian(const double* x, double* jacobian) const {
  const Line3 line = from_line_block(x);
  const Axes axes(line.direction);
  const Eigen::Vector3d p = line.nearest_to_origin();
  Eigen::Map<Eigen::Matrix<double, 6, 4, Eigen::RowMajor>> j(jacobian);
  j.topRows<3>() << p.cross(axes.u1), p.cross(axes.u3), axes.u1.cross(line.direction),
      axes.u3.cross(line.direction);
  j.bottomRows<3>() << axes.u1, axes.u3, Eigen::Matrix<double, 3, 2>::Zero();
  return true;
}

bool Line3Manifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  const Line3 to = from_line_block(y), from = from_line_block(x);
  const double cosine = from.direction.dot(to.direction);
  if (!(cosine > 0.0)) return false;
  // Where the line meets the plane through the origin at a right angle to the other's direction.
  const Eigen::Vector3d p = from.direction.cross(to.moment) / cosine;
  const Eigen::Vector3d a = to.direction / cosine, b = p - from.nearest_to_origin();
  const Axes axes(from.direction);
  Eigen::Map<Eigen::Vector4d>(y_minus_x) << axes.u1.dot(a), axes.u3.dot(a), axes.u1.dot(b), axes.u3.dot(b);
  return true;
}

bool Line3Manifold::MinusJacobian(const double* x, double* jacobian) const {
  const Line3 line = from_line_block(x);
  const Axes axes(line.direction);
  const Eigen::Vector3d p = line.nearest_to_origin();
  Eigen::Map<Eigen::Matrix<double, 4, 6, Eigen::RowMajor>> j(jacobian);
  j.setZero();
  j.block<1, 3>(0, 3) = axes.u1;
  j.block<1, 3>(1, 3) = axes.u3;
  j.block<1, 3>(2, 0) = axes.u1.cross(line.direction);
  j.block<1, 3>(3, 0) = axes.u3.cross(line.direction);
  j.block<1, 3>(2, 3) = -axes.u1.dot(p) * line.direction;
  j.block<1, 3>(3, 3) = -axes.u3.dot(p) * line.direction;
  return true;
}

}  // namespace ipl_slam
