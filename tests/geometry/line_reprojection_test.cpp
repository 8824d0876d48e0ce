#include "geometry/line_reprojection.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "geometry/numeric_diff.hpp"

namespace ipl_slam {
namespace {

using testing::numeric_jacobian;

const Camera kCamera{.fx = 517.0, .fy = 490.0, .cx = 318.0, .cy = 255.0};
const Eigen::Vector2d kPixel(200.0, 300.0);
constexpr double kInverseDepth = 0.45;
const SE3 kPose = SE3::exp((Vector6d() << 0.2, -0.4, 0.3, 0.5, -0.2, 0.9).finished());

// Across, away from the camera, and at a slant.
const std::vector<Line3> kLinesInCamera = {*Line3::through({-1.0, 0.2, 2.0}, {1.0, 0.2, 2.0}),
                                           *Line3::through({0.4, 0.5, 1.0}, {0.5, 0.5, 6.0}),
                                           *Line3::through({-1.5, -1.0, 5.0}, {0.8, 1.2, 2.0})};

using Array3 = double[3];

void copy(const Eigen::Vector3d& from, Array3& to) {
  Eigen::Map<Eigen::Vector3d>{to} = from;
}

LineResidual<double> residual(const Line3& line_c) {
  Array3 n, d;
  copy(line_c.moment, n), copy(line_c.direction, d);
  ProjectedLine<double> l;
  project_moment(
      kCamera, n, [](double x) { return std::sqrt(x); }, l);
  LineResidual<double> r;
  line_residual(kCamera, n, d, l, kPixel.x(), kPixel.y(), r);
  return r;
}

LineDepthResidual<double> depth_residual(const Line3& line_c) {
  Array3 n, d;
  copy(line_c.moment, n), copy(line_c.direction, d);
  LineDepthResidual<double> r;
  line_depth_residual(kCamera, n, d, kPixel.x(), kPixel.y(), kInverseDepth, r);
  return r;
}

using Scalar = Eigen::Matrix<double, 1, 1>;
using Row3 = Eigen::RowVector3d;
using Row6 = Eigen::Matrix<double, 1, 6>;

// Relative to the derivative's own size: numeric differentiation is good to 1e-8 of it.
template <class Row>
void expect_same(const double* actual, const Row& expected) {
  ASSERT_GT(expected.norm(), 0.01);
  EXPECT_LT((Eigen::Map<const Row>(actual) - expected).norm(), 1e-7 * expected.norm())
      << Eigen::Map<const Row>(actual) << " instead of " << expected;
}

TEST(LineResidual, is_the_signed_distance_of_the_pixel_from_the_projected_line) {
  for (const Line3& line : kLinesInCamera)
    EXPECT_NEAR(residual(line).e, signed_distance(*project_line(kCamera, line), kPixel), 1e-11);
}

TEST(LineResidual, its_jacobian_of_the_moment_agrees_with_numeric_differentiation) {
  for (const Line3& line : kLinesInCamera) {
    const auto moved = [&](const Eigen::Vector3d& n) {
      return Scalar(residual({line.moment + n, line.direction}).e);
    };
    expect_same<Row3>(residual(line).jacobian_n, numeric_jacobian<1, 3>(moved));
  }
}

TEST(LineResidual, its_pose_jacobian_is_that_of_the_left_perturbation) {
  for (const Line3& line : kLinesInCamera) {
    const Line3 line_w = kPose.inverse() * line;
    const auto moved = [&](const Vector6d& xi) { return Scalar(residual(SE3::exp(xi) * kPose * line_w).e); };
    expect_same<Row6>(residual(line).jacobian_xi, numeric_jacobian<1, 6>(moved));
  }
}

TEST(LineResidual, does_not_feel_a_camera_that_moves_along_the_line) {
  for (const Line3& line : kLinesInCamera) {
    const LineResidual<double> r = residual(line);
    const Eigen::Map<const Eigen::Vector3d> rho(r.jacobian_xi);
    EXPECT_NEAR(rho.dot(line.direction), 0.0, 1e-12 * rho.norm());
  }
}

TEST(LineDepthResidual, is_measured_minus_predicted_inverse_depth) {
  for (const Line3& line : kLinesInCamera)
    EXPECT_NEAR(depth_residual(line).e, kInverseDepth - inverse_depth_at(kCamera, line, kPixel), 1e-14);
}

TEST(LineDepthResidual, its_jacobians_of_moment_and_direction_agree_with_numeric_differentiation) {
  for (const Line3& line : kLinesInCamera) {
    const auto moved_n = [&](const Eigen::Vector3d& n) {
      return Scalar(depth_residual({line.moment + n, line.direction}).e);
    };
    const auto moved_d = [&](const Eigen::Vector3d& d) {
      return Scalar(depth_residual({line.moment, line.direction + d}).e);
    };
    expect_same<Row3>(depth_residual(line).jacobian_n, numeric_jacobian<1, 3>(moved_n));
    expect_same<Row3>(depth_residual(line).jacobian_d, numeric_jacobian<1, 3>(moved_d));
  }
}

TEST(LineDepthResidual, its_pose_jacobian_is_that_of_the_left_perturbation) {
  for (const Line3& line : kLinesInCamera) {
    const Line3 line_w = kPose.inverse() * line;
    const auto moved = [&](const Vector6d& xi) {
      return Scalar(depth_residual(SE3::exp(xi) * kPose * line_w).e);
    };
    expect_same<Row6>(depth_residual(line).jacobian_xi, numeric_jacobian<1, 6>(moved));
  }
}

TEST(LineDepthResidual, is_finite_down_to_the_smallest_distance_of_a_line) {
  const Line3 line = *Line3::through({kMinLineDistance, 0.0, 1.0}, {kMinLineDistance, 0.0, 2.0});
  const LineDepthResidual<double> r = depth_residual(line);
  EXPECT_TRUE(std::isfinite(r.e));
  EXPECT_TRUE(Eigen::Map<const Vector6d>(r.jacobian_xi).allFinite());
}

}  // namespace
}  // namespace ipl_slam
