#include "loop/relative_pose_cost.hpp"

#include "geometry/se3_jacobian.hpp"

namespace ipl_slam {

bool RelativePoseCost::Evaluate(double const* const* parameters, double* residuals,
                                double** jacobians) const {
  const SE3 T_ab_now = from_pose_block(parameters[0]) * from_pose_block(parameters[1]).inverse();
  const Vector6d e = (T_ab_now * T_ba_).log();
  Eigen::Map<Vector6d>{residuals} = scale_.cwiseProduct(e);
  if (!jacobians) return true;

  const Matrix6d de_dxi_a = scale_.asDiagonal() * left_jacobian_inverse(e);
  const Matrix6d de_dxi[] = {de_dxi_a, -de_dxi_a * adjoint(T_ab_now)};
  for (int i = 0; i < 2; ++i) {
    if (!jacobians[i]) continue;
    Eigen::Matrix<double, 6, kPoseBlockSize, Eigen::RowMajor> dxi_dpose;
    SE3Manifold().MinusJacobian(parameters[i], dxi_dpose.data());
    Eigen::Map<Eigen::Matrix<double, 6, kPoseBlockSize, Eigen::RowMajor>> j(jacobians[i]);
    j.noalias() = de_dxi[i] * dxi_dpose;
  }
  return true;
}

}  // namespace ipl_slam
