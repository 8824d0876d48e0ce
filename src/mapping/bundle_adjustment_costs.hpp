#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <ceres/sized_cost_function.h>

#include "geometry/camera.hpp"
#include "geometry/reprojection.hpp"
#include "geometry/se3_manifold.hpp"
#include "mapping/bundle_adjustment.hpp"

namespace ipl_slam {

/// Bounds of what is taken for a coordinate, pixel or variance, the same as the pose optimiser's: beyond them
/// squares lose their meaning.
[[nodiscard]] inline bool sensible(double value) {
  return std::abs(value) < 1e9;
}

/// The residual of geometry/reprojection.hpp as Ceres wants it: in standard deviations, times the root of the
/// weight, as a function of the pose block of T_cw (geometry/se3_manifold.hpp) and the world point. kRows is
/// 2 (pixel) or 3 (pixel and inverse depth). While the point has no projection the residual is a constant, so
/// an iteration that hides a point behind the camera costs something, and the optimisation as a whole goes
/// on.
template <int kRows>
class PointCost final : public ceres::SizedCostFunction<kRows, kPoseBlockSize, 3> {
 public:
  /// The camera must outlive the cost. For kRows = 3 the observation must have a depth.
  PointCost(const Camera& camera, const DepthNoiseOptions& noise,
            const BundleProblem::Observation& observation)
      : camera_(&camera), uv_(observation.uv), inverse_depth_(kRows == 3 ? 1.0 / observation.depth : 0.0) {
    const double pixel_scale = std::sqrt(observation.weight / observation.sigma2);
    scale_[0] = scale_[1] = pixel_scale;
    if constexpr (kRows == 3) scale_[2] = std::sqrt(observation.weight) / noise.inverse_depth_sigma;
    behind_ = std::sqrt(observation.weight * kBehindCameraChi2 / kRows);
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  using Rows = Eigen::Matrix<double, kRows, 3>;

  const Camera* camera_;
  Eigen::Vector2d uv_;
  double inverse_depth_;
  double scale_[kRows];
  double behind_;
};

template <int kRows>
bool PointCost<kRows>::Evaluate(double const* const* parameters, double* residuals,
                                double** jacobians) const {
  const Eigen::Map<const Eigen::Vector3d> q(parameters[0]), t(parameters[0] + 4), p(parameters[1]);
  const double w = parameters[0][3];
  // R p = p + 2 w (q x p) + 2 q x (q x p) with q the quaternion's vector part.
  const Eigen::Vector3d qp = q.cross(p);
  const Eigen::Vector3d p_c = p + 2.0 * (w * qp + q.cross(qp)) + t;
  if (!(p_c.z() >= kMinProjectionDepth)) {
    std::fill_n(residuals, kRows, behind_);
    if (jacobians && jacobians[0]) std::fill_n(jacobians[0], kRows * kPoseBlockSize, 0.0);
    if (jacobians && jacobians[1]) std::fill_n(jacobians[1], kRows * 3, 0.0);
    return true;
  }

  PointResidual<double> r;
  point_residual(*camera_, p_c.x(), p_c.y(), p_c.z(), uv_.x(), uv_.y(), inverse_depth_, r);
  for (int i = 0; i < kRows; ++i) residuals[i] = scale_[i] * r.e[i];
  if (!jacobians) return true;

  Rows de_dpc;
  for (int i = 0; i < kRows; ++i)
    for (int j = 0; j < 3; ++j) de_dpc(i, j) = scale_[i] * r.jacobian[i][j];
  if (jacobians[0]) {
    Eigen::Map<Eigen::Matrix<double, kRows, kPoseBlockSize, Eigen::RowMajor>> j(jacobians[0]);
    Eigen::Matrix<double, 3, 4> dpc_dq;
    dpc_dq.template leftCols<3>() = 2.0 * (-w * skew(p) + q.dot(p) * Eigen::Matrix3d::Identity() +
                                           q * p.transpose() - 2.0 * p * q.transpose());
    dpc_dq.col(3) = 2.0 * qp;
    j.template leftCols<4>().noalias() = de_dpc * dpc_dq;
    j.template rightCols<3>() = de_dpc;
  }
  if (jacobians[1]) {
    Eigen::Map<Eigen::Matrix<double, kRows, 3, Eigen::RowMajor>> j(jacobians[1]);
    const Eigen::Matrix3d W = skew(q);
    j.noalias() = de_dpc * (Eigen::Matrix3d::Identity() + 2.0 * (w * W + W * W));
  }
  return true;
}

}  // namespace ipl_slam
