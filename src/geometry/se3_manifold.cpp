#include "geometry/se3_manifold.hpp"

namespace ipl_slam {
namespace {

// d q(exp(phi)) * q / d phi at phi = 0, rows in Eigen's order x y z w: half of (phi, 0) * q.
Eigen::Matrix<double, 4, 3> quaternion_jacobian(const double* q) {
  Eigen::Matrix<double, 4, 3> j;
  j << q[3], q[2], -q[1],  //
      -q[2], q[3], q[0],   //
      q[1], -q[0], q[3],   //
      -q[0], -q[1], -q[2];
  return 0.5 * j;
}

}  // namespace

void to_pose_block(const SE3& pose, double* block) {
  Eigen::Map<Eigen::Matrix<double, kPoseBlockSize, 1>> out(block);
  out << pose.rotation().coeffs(), pose.translation();
}

SE3 from_pose_block(const double* block) {
  return {Eigen::Quaterniond(block), Eigen::Vector3d(block[4], block[5], block[6])};
}

bool SE3Manifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  const Eigen::Map<const Vector6d> xi(delta);
  to_pose_block(SE3::exp(xi) * from_pose_block(x), x_plus_delta);
  return true;
}

bool SE3Manifold::PlusJacobian(const double* x, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>> j(jacobian);
  j.setZero();
  j.block<4, 3>(0, 3) = quaternion_jacobian(x);
  j.block<3, 3>(4, 0).setIdentity();
  j.block<3, 3>(4, 3) = -skew(Eigen::Vector3d(x[4], x[5], x[6]));
  return true;
}

bool SE3Manifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  Eigen::Map<Vector6d> xi(y_minus_x);
  xi = (from_pose_block(y) * from_pose_block(x).inverse()).log();
  return true;
}

bool SE3Manifold::MinusJacobian(const double* x, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>> j(jacobian);
  // The columns of quaternion_jacobian are orthogonal with length 1/2: four times its transpose inverts it.
  const Eigen::Matrix<double, 3, 4> dphi_dq = 4.0 * quaternion_jacobian(x).transpose();
  j.setZero();
  j.block<3, 4>(0, 0) = skew(Eigen::Vector3d(x[4], x[5], x[6])) * dphi_dq;
  j.block<3, 3>(0, 4).setIdentity();
  j.block<3, 4>(3, 0) = dphi_dq;
  return true;
}

}  // namespace ipl_slam
