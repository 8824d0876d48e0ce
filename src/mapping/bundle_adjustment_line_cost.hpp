#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <ceres/sized_cost_function.h>

#include "geometry/camera.hpp"
#include "geometry/line3_manifold.hpp"
#include "geometry/line_reprojection.hpp"
#include "geometry/reprojection.hpp"
#include "geometry/se3_manifold.hpp"
#include "mapping/bundle_adjustment.hpp"

namespace ipl_slam {

/// An observed end point of a line.
struct LineEnd {
  Eigen::Vector2d uv;    ///< undistorted pixel
  double inverse_depth;  ///< measured, 1/m; <= 0 = none
  double sigma;          ///< its standard deviation, 1/m
};

/// Whether a line of the camera frame has an image and lies in front of the camera at both end points.
[[nodiscard]] inline bool shows_at(const Camera& camera, const Line3& line_c,
                                   const std::array<LineEnd, 2>& ends) {
  return project_line(camera, line_c) && inverse_depth_at(camera, line_c, ends[0].uv) > 0.0 &&
         inverse_depth_at(camera, line_c, ends[1].uv) > 0.0;
}

/// The residuals of geometry/line_reprojection.hpp as Ceres wants them: in standard deviations, times the
/// root of the weight, as a function of the pose block of T_cw and the block of the line in the world
/// (geometry/line3_manifold.hpp). Two rows for the distances of the end points, then one for the inverse
/// depth of each of the first kRows - 2 end points. While the line does not show at the end points the
/// residual is a constant, for the same reason as PointCost's.
template <int kRows>
class LineCost final : public ceres::SizedCostFunction<kRows, kPoseBlockSize, kLineBlockSize> {
 public:
  /// The camera must outlive the cost. End points with a depth come first.
  LineCost(const Camera& camera, const std::array<LineEnd, 2>& ends, double sigma2, double weight)
      : camera_(&camera), ends_(ends) {
    scale_.template head<2>().setConstant(std::sqrt(weight / sigma2));
    for (int i = 2; i < kRows; ++i)
      scale_[i] = std::sqrt(weight) / ends[static_cast<std::size_t>(i - 2)].sigma;
    behind_ = std::sqrt(weight * kBehindCameraChi2 / kRows);
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  /// Residuals and their derivatives with respect to the line and the pose perturbation, in the camera frame.
  struct Rows {
    Eigen::Matrix<double, kRows, 1> e;
    Eigen::Matrix<double, kRows, 3> n = decltype(n)::Zero(), d = decltype(d)::Zero();
    Eigen::Matrix<double, kRows, 6> xi;
  };
  [[nodiscard]] Rows rows(const Line3& line_c) const;

  const Camera* camera_;
  std::array<LineEnd, 2> ends_;
  Eigen::Matrix<double, kRows, 1> scale_;
  double behind_;
};

template <int kRows>
typename LineCost<kRows>::Rows LineCost<kRows>::rows(const Line3& line_c) const {
  using Row3 = Eigen::Map<const Eigen::RowVector3d>;
  using Row6 = Eigen::Map<const Eigen::Matrix<double, 1, 6>>;
  const double n[3] = {line_c.moment.x(), line_c.moment.y(), line_c.moment.z()};
  const double d[3] = {line_c.direction.x(), line_c.direction.y(), line_c.direction.z()};
  ProjectedLine<double> image;
  project_moment(
      *camera_, n, [](double x) { return std::sqrt(x); }, image);
  Rows out;
  for (int i = 0; i < 2; ++i) {
    const Eigen::Vector2d& uv = ends_[static_cast<std::size_t>(i)].uv;
    LineResidual<double> r;
    line_residual(*camera_, n, d, image, uv.x(), uv.y(), r);
    out.e[i] = r.e, out.n.row(i) = Row3(r.jacobian_n), out.xi.row(i) = Row6(r.jacobian_xi);
  }
  for (int i = 2; i < kRows; ++i) {
    const LineEnd& end = ends_[static_cast<std::size_t>(i - 2)];
    LineDepthResidual<double> r;
    line_depth_residual(*camera_, n, d, end.uv.x(), end.uv.y(), end.inverse_depth, r);
    out.e[i] = r.e, out.n.row(i) = Row3(r.jacobian_n), out.d.row(i) = Row3(r.jacobian_d);
    out.xi.row(i) = Row6(r.jacobian_xi);
  }
  return out;
}

template <int kRows>
bool LineCost<kRows>::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const SE3 T_cw = from_pose_block(parameters[0]);
  const Line3 line_c = T_cw * from_line_block(parameters[1]);
  if (!shows_at(*camera_, line_c, ends_)) {
    std::fill_n(residuals, kRows, behind_);
    if (jacobians && jacobians[0]) std::fill_n(jacobians[0], kRows * kPoseBlockSize, 0.0);
    if (jacobians && jacobians[1]) std::fill_n(jacobians[1], kRows * kLineBlockSize, 0.0);
    return true;
  }

  const Rows r = rows(line_c);
  Eigen::Map<Eigen::Matrix<double, kRows, 1>>{residuals} = scale_.cwiseProduct(r.e);
  if (!jacobians) return true;
  if (jacobians[0]) {
    Eigen::Matrix<double, 6, kPoseBlockSize, Eigen::RowMajor> dxi_dpose;
    SE3Manifold().MinusJacobian(parameters[0], dxi_dpose.data());
    Eigen::Map<Eigen::Matrix<double, kRows, kPoseBlockSize, Eigen::RowMajor>> j(jacobians[0]);
    j.noalias() = scale_.asDiagonal() * r.xi * dxi_dpose;
  }
  if (jacobians[1]) {
    // n_c = R n_w + t x R d_w, d_c = R d_w.
    const Eigen::Matrix3d R = T_cw.rotation_matrix();
    Eigen::Map<Eigen::Matrix<double, kRows, kLineBlockSize, Eigen::RowMajor>> j(jacobians[1]);
    j.template leftCols<3>().noalias() = scale_.asDiagonal() * r.n * R;
    j.template rightCols<3>().noalias() = scale_.asDiagonal() * (r.d + r.n * skew(T_cw.translation())) * R;
  }
  return true;
}

}  // namespace ipl_slam
