#include "geometry/line3_manifold.hpp"

#include <cmath>

namespace ipl_slam {
namespace {

// The axes u1 and u3 beside the direction d. Which ones does not matter, as long as a line always has the
// same.
struct Axes {
  Eigen::Vector3d u1, u3;

  explicit Axes(const Eigen::Vector3d& d) : u1(d.unitOrthogonal()), u3(u1.cross(d)) {}
};

Eigen::Quaterniond rotation(const Eigen::Vector3d& phi) {
  Vector6d xi;
  xi << Eigen::Vector3d::Zero(), phi;
  return SE3::exp(xi).rotation();
}

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
  const Eigen::Quaterniond R = rotation(delta[0] * axes.u1 + delta[1] * axes.u3);
  to_line_block({R * (line.moment + delta[2] * axes.u1 + delta[3] * axes.u3), R * line.direction},
                x_plus_delta);
  return true;
}

bool Line3Manifold::PlusJacobian(const double* x, double* jacobian) const {
  const Line3 line = from_line_block(x);
  const Axes axes(line.direction);
  Eigen::Map<Eigen::Matrix<double, 6, 4, Eigen::RowMajor>> j(jacobian);
  j.topRows<3>() << axes.u1.cross(line.moment), axes.u3.cross(line.moment), axes.u1, axes.u3;
  j.bottomRows<3>() << axes.u1.cross(line.direction), axes.u3.cross(line.direction),
      Eigen::Matrix<double, 3, 2>::Zero();
  return true;
}

bool Line3Manifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  const Line3 to = from_line_block(y), from = from_line_block(x);
  const Axes axes(from.direction);
  // The shortest turn from one direction to the other has its axis at a right angle to both.
  const Eigen::Vector3d across = from.direction.cross(to.direction);
  const double sine = across.norm(), angle = std::atan2(sine, from.direction.dot(to.direction));
  const Eigen::Vector3d phi = sine > 0.0 ? Eigen::Vector3d(angle / sine * across) : angle * axes.u1;
  const Eigen::Vector3d shift = rotation(-phi) * to.moment - from.moment;
  Eigen::Map<Eigen::Vector4d>(y_minus_x) << axes.u1.dot(phi), axes.u3.dot(phi), axes.u1.dot(shift),
      axes.u3.dot(shift);
  return true;
}

bool Line3Manifold::MinusJacobian(const double* x, double* jacobian) const {
  const Line3 line = from_line_block(x);
  const Axes axes(line.direction);
  Eigen::Map<Eigen::Matrix<double, 4, 6, Eigen::RowMajor>> j(jacobian);
  // A turn moves n along d alone, so the shifts do not see it.
  j.setZero();
  j.block<1, 3>(0, 3) = axes.u1.cross(line.direction);
  j.block<1, 3>(1, 3) = axes.u3.cross(line.direction);
  j.block<1, 3>(2, 0) = axes.u1;
  j.block<1, 3>(3, 0) = axes.u3;
  return true;
}

}  // namespace ipl_slam
