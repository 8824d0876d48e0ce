#include "geometry/se3_jacobian.hpp"

#include <cmath>

namespace ipl_slam {

Matrix6d adjoint(const SE3& T) {
  const Eigen::Matrix3d R = T.rotation_matrix();
  Matrix6d ad;
  ad << R, skew(T.translation()) * R, Eigen::Matrix3d::Zero(), R;
  return ad;
}

// J = f(A) with f(x) = x / (e^x - 1) = (x/2) coth(x/2) - x/2 and A = ad(xi), whose eigenvalues are 0 and +-i
// theta, each of them double. So the even part of f is 1 + a A^2 + b A^4, where a and b follow from its value
// h and its slope at i theta: 1 - a theta^2 + b theta^4 = h = (theta/2) cot(theta/2), and the same derived.
Matrix6d left_jacobian_inverse(const Vector6d& xi) {
  constexpr double kSeries = 0.1;  // below, h - 1 loses too many digits; the next terms are under 1e-11
  const Eigen::Vector3d rho = xi.head<3>(), phi = xi.tail<3>();
  const double theta2 = phi.squaredNorm(), theta = std::sqrt(theta2);
  double a = 1.0 / 12.0 - theta2 * theta2 / 30240.0, b = -1.0 / 720.0 - theta2 / 15120.0;
  if (theta > kSeries) {
    const double s = std::sin(0.5 * theta), h = 0.5 * theta * std::cos(0.5 * theta) / s;
    const double theta_dh = h - 0.25 * theta2 / (s * s);
    a = (theta_dh + 4.0 * (1.0 - h)) / (2.0 * theta2);
    b = (theta_dh + 2.0 * (1.0 - h)) / (2.0 * theta2 * theta2);
  }
  Matrix6d A;
  A << skew(phi), skew(rho), Eigen::Matrix3d::Zero(), skew(phi);
  const Matrix6d A2 = A * A;
  return Matrix6d::Identity() - 0.5 * A + a * A2 + b * A2 * A2;
}

}  // namespace ipl_slam
