#include "geometry/se3.hpp"

#include <cmath>

namespace ipl_slam {
namespace {

// Below this angle the series of the closed forms are used; their error is then far under double precision.
constexpr double kSmallAngle = 1e-5;

// Left Jacobian of SO(3), which couples the twist's translational part with its rotation.
Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& phi) {
  const double theta = phi.norm();
  const Eigen::Matrix3d W = skew(phi);
  if (theta < kSmallAngle) return Eigen::Matrix3d::Identity() + 0.5 * W + W * W / 6.0;
  const double theta2 = theta * theta;
  const double s =
      std::sin(0.5 * theta);  // 2 s^2 is 1 - cos(theta), without its cancellation at small angles
  return Eigen::Matrix3d::Identity() + 2.0 * s * s / theta2 * W +
         (theta - std::sin(theta)) / (theta2 * theta) * W * W;
}

}  // namespace

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

SE3 SE3::exp(const Vector6d& twist) {
  const Eigen::Vector3d phi = twist.tail<3>();
  const double half = 0.5 * phi.norm();
  const double sinc = half < kSmallAngle ? 0.5 - half * half / 12.0 : std::sin(half) / (2.0 * half);
  const Eigen::Quaterniond q(std::cos(half), sinc * phi.x(), sinc * phi.y(), sinc * phi.z());
  return {q, left_jacobian(phi) * twist.head<3>()};
}

double SE3::angle() const {
  return 2.0 * std::atan2(q_.vec().norm(), std::abs(q_.w()));
}

Vector6d SE3::log() const {
  // q and -q are the same rotation; the one with w >= 0 has the smaller angle.
  const double sign = q_.w() < 0.0 ? -1.0 : 1.0;
  const Eigen::Vector3d v = sign * q_.vec();
  const double n = v.norm();
  const double scale = n < kSmallAngle ? 2.0 / (sign * q_.w()) : 2.0 * std::atan2(n, sign * q_.w()) / n;
  const Eigen::Vector3d phi = scale * v;
  Vector6d twist;
  twist << left_jacobian(phi).partialPivLu().solve(t_), phi;
  return twist;
}

}  // namespace ipl_slam
