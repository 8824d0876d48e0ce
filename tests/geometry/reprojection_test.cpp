#include "geometry/reprojection.hpp"

#include <gtest/gtest.h>

#include "geometry/numeric_diff.hpp"
#include "geometry/robust.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {
namespace {

using testing::numeric_jacobian;

const Camera kCamera{.fx = 517.0, .fy = 490.0, .cx = 318.0, .cy = 255.0};
const Eigen::Vector2d kPixel(200.0, 300.0);
constexpr double kInverseDepth = 0.45;

PointResidual<double> residual(const Eigen::Vector3d& p_c) {
  PointResidual<double> r;
  point_residual(kCamera, p_c.x(), p_c.y(), p_c.z(), kPixel.x(), kPixel.y(), kInverseDepth, r);
  return r;
}

Eigen::Vector3d error(const Eigen::Vector3d& p_c) {
  return Eigen::Map<const Eigen::Vector3d>(residual(p_c).e);
}

Eigen::Matrix<double, 3, 6> jacobian(const Eigen::Vector3d& p_c) {
  const PointResidual<double> r = residual(p_c);
  return Eigen::Map<const Eigen::Matrix<double, 3, 6, Eigen::RowMajor>>(&r.jacobian[0][0]);
}

const SE3 kPose = SE3::exp((Vector6d() << 0.2, -0.4, 0.3, 0.5, -0.2, 0.9).finished());
const std::vector<Eigen::Vector3d> kPointsInCamera = {{0.3, -0.2, 1.1}, {-2.0, 1.5, 3.7}, {0.0, 0.0, 0.5}};

TEST(PointResidual, is_measured_minus_predicted_pixel_and_inverse_depth) {
  const Eigen::Vector3d p_c(0.5, -1.0, 2.0);
  const Eigen::Vector2d predicted = kCamera.project(p_c);
  EXPECT_NEAR(error(p_c).x(), kPixel.x() - predicted.x(), 1e-12);
  EXPECT_NEAR(error(p_c).y(), kPixel.y() - predicted.y(), 1e-12);
  EXPECT_NEAR(error(p_c).z(), kInverseDepth - 0.5, 1e-15);
}

TEST(PointResidual, its_pose_jacobian_is_that_of_the_left_perturbation) {
  for (const Eigen::Vector3d& p_c : kPointsInCamera) {
    const Eigen::Vector3d p_w = kPose.inverse() * p_c;
    const auto moved = [&](const Vector6d& xi) { return error(SE3::exp(xi) * kPose * p_w); };
    const Eigen::Matrix<double, 3, 6> expected = numeric_jacobian<3, 6>(moved);
    EXPECT_LT((jacobian(p_c) - expected).norm(), 1e-7 * expected.norm()) << p_c.transpose();
  }
}

TEST(PointResidual, its_first_columns_times_the_rotation_are_the_jacobian_of_the_world_point) {
  for (const Eigen::Vector3d& p_c : kPointsInCamera) {
    const Eigen::Vector3d p_w = kPose.inverse() * p_c;
    const auto moved = [&](const Eigen::Vector3d& d) { return error(kPose * (p_w + d)); };
    const Eigen::Matrix3d expected = numeric_jacobian<3, 3>(moved);
    const Eigen::Matrix3d actual = jacobian(p_c).leftCols<3>() * kPose.rotation_matrix();
    EXPECT_LT((actual - expected).norm(), 1e-7 * expected.norm()) << p_c.transpose();
  }
}

TEST(PointResidual, columns_that_are_not_listed_are_zero) {
  const auto listed = [](const auto& columns, int c) {
    return std::find(columns.begin(), columns.end(), c) != columns.end();
  };
  const Eigen::Matrix<double, 3, 6> j =
      jacobian(kPointsInCamera[0]);  // a point off all axes: the rest differs from 0
  for (int c = 0; c < 6; ++c) {
    EXPECT_EQ(j(0, c) != 0.0, listed(kColumnsU, c)) << c;
    EXPECT_EQ(j(1, c) != 0.0, listed(kColumnsV, c)) << c;
    EXPECT_EQ(j(2, c) != 0.0, listed(kColumnsD, c)) << c;
  }
}

TEST(Huber, is_quadratic_inside_and_linear_outside_with_the_weight_as_its_slope) {
  constexpr double delta = 2.0;
  EXPECT_EQ(huber_cost(3.0, delta), 3.0);
  EXPECT_EQ(huber_weight(3.0, delta), 1.0);
  EXPECT_EQ(huber_cost(25.0, delta), 2.0 * delta * 5.0 - 4.0);
  EXPECT_NEAR(huber_cost(4.0 + 1e-9, delta), 4.0, 2e-9);  // continuous where the pieces meet
  for (const double s : {1.0, 9.0, 400.0}) {
    const double slope = (huber_cost(s + 1e-4, delta) - huber_cost(s - 1e-4, delta)) / 2e-4;
    EXPECT_NEAR(huber_weight(s, delta), slope, 1e-8) << s;
  }
}

TEST(Chi2, thresholds_leave_five_percent_of_the_distribution_outside) {
  // The constants have three decimals, which leaves 0.0005 x density (0.025) = 1.3e-5 of the probability
  // open. 2 degrees of freedom: the distribution is exponential.
  EXPECT_NEAR(std::exp(-kChi2For2Dof / 2.0), 0.05, 1.3e-5);
  // 3 degrees of freedom: 1 - F(x) = erfc(sqrt(x/2)) + sqrt(2x/pi) exp(-x/2).
  EXPECT_NEAR(std::erfc(std::sqrt(kChi2For3Dof / 2.0)) +
                  std::sqrt(2.0 * kChi2For3Dof / std::acos(-1.0)) * std::exp(-kChi2For3Dof / 2.0),
              0.05, 1.3e-5);
  // 4 degrees of freedom: 1 - F(x) = (1 + x/2) exp(-x/2), with the density 0.021 there.
  EXPECT_NEAR((1.0 + kChi2For4Dof / 2.0) * std::exp(-kChi2For4Dof / 2.0), 0.05, 1.3e-5);
}

}  // namespace
}  // namespace ipl_slam
