#include "geometry/se3.hpp"

#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/LU>
#include <ceres/manifold_test_utils.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unsupported/Eigen/MatrixFunctions>

#include "geometry/se3_manifold.hpp"

namespace ipl_slam {
namespace {

Vector6d twist(const Eigen::Vector3d& rho, const Eigen::Vector3d& phi) {
  Vector6d xi;
  xi << rho, phi;
  return xi;
}

const Eigen::Vector3d kAxis = Eigen::Vector3d(0.3, -0.8, 0.52).normalized();
const Eigen::Vector3d kRho(0.7, -1.3, 2.1);

// Angles from nothing to just short of half a turn, and both sides of the switch to series at 1e-5.
const std::vector<double> kAngles = {
    0.0, 1e-12, 1e-8, 0.9e-5, 1.1e-5, 1.9e-5, 2.1e-5, 1e-3, 0.1, 1.0, 2.5, 3.1, std::numbers::pi - 1e-6};

TEST(SE3, log_undoes_exp_from_tiny_angles_to_almost_half_a_turn) {
  for (const double angle : kAngles) {
    const Vector6d xi = twist(kRho, angle * kAxis);
    // Twenty roundings of numbers of size 2; near pi the inverse of the left Jacobian magnifies them a
    // little.
    EXPECT_LT((SE3::exp(xi).log() - xi).norm(), 1e-13) << angle;
  }
}

TEST(SE3, exp_agrees_with_the_exponential_of_the_four_by_four_matrix) {
  for (const double angle : kAngles) {
    Eigen::Matrix4d generator = Eigen::Matrix4d::Zero();
    generator.topLeftCorner<3, 3>() = skew(angle * kAxis);
    generator.topRightCorner<3, 1>() = kRho;
    const Eigen::Matrix4d expected = generator.exp();
    const SE3 T = SE3::exp(twist(kRho, angle * kAxis));
    // The scaling and squaring of the reference is good to about 1e-14.
    EXPECT_LT((T.rotation_matrix() - expected.topLeftCorner<3, 3>()).norm(), 1e-13) << angle;
    EXPECT_LT((T.translation() - expected.topRightCorner<3, 1>()).norm(), 1e-13) << angle;
  }
}

TEST(SE3, exp_undoes_log_at_exactly_half_a_turn) {
  const SE3 T(Eigen::Quaterniond(0.0, kAxis.x(), kAxis.y(), kAxis.z()), kRho);
  EXPECT_NEAR(T.log().tail<3>().norm(), std::numbers::pi, 1e-14);
  const SE3 back = SE3::exp(T.log());
  EXPECT_LT((back.rotation_matrix() - T.rotation_matrix()).norm(), 1e-13);
  EXPECT_LT((back.translation() - T.translation()).norm(), 1e-13);
}

TEST(SE3, a_quaternion_and_its_negative_have_the_same_log) {
  const SE3 T = SE3::exp(twist(kRho, 2.0 * kAxis));
  const SE3 U(Eigen::Quaterniond(-T.rotation().coeffs()), T.translation());
  EXPECT_LT((T.log() - U.log()).norm(), 1e-14);
  EXPECT_NEAR(T.angle(), 2.0, 1e-14);
  EXPECT_NEAR(U.angle(), 2.0, 1e-14);
}

TEST(SE3, composition_and_inverse_act_on_points_as_they_should) {
  const SE3 T_ab = SE3::exp(twist(kRho, 1.2 * kAxis)),
            T_bc = SE3::exp(twist(-kRho, Eigen::Vector3d(0.1, 2.0, 0.3)));
  const Eigen::Vector3d p_c(0.4, -2.0, 3.3);
  EXPECT_LT(((T_ab * T_bc) * p_c - T_ab * (T_bc * p_c)).norm(), 1e-13);
  EXPECT_LT((T_ab.inverse() * (T_ab * p_c) - p_c).norm(), 1e-13);
}

Eigen::VectorXd block(const SE3& pose) {
  Eigen::VectorXd x(kPoseBlockSize);
  to_pose_block(pose, x.data());
  return x;
}

TEST(SE3Manifold, holds_what_ceres_asks_of_a_manifold) {
  // Ceres' own conditions: plus and minus undo each other, and their Jacobians agree with numeric
  // differentiation.
  using namespace ceres;  // the macro below needs its matchers unqualified
  const SE3Manifold manifold;
  const SE3 x = SE3::exp(twist(kRho, 1.2 * kAxis)), y = SE3::exp(twist(-0.2 * kRho, 0.4 * kAxis)) * x;
  for (const double angle : {1e-9, 1e-4, 0.3, 2.0}) {
    const Eigen::VectorXd delta = twist(0.5 * kRho, angle * Eigen::Vector3d(0.6, 0.0, 0.8));
    EXPECT_THAT_MANIFOLD_INVARIANTS_HOLD(manifold, block(x), delta, block(y), 1e-9);
  }
}

TEST(SE3Manifold, moves_a_pose_by_the_left_perturbation) {
  const SE3 x = SE3::exp(twist(kRho, 1.2 * kAxis));
  const Vector6d xi = twist(Eigen::Vector3d(0.1, 0.2, -0.3), 0.3 * kAxis);
  Eigen::VectorXd moved(kPoseBlockSize);
  ASSERT_TRUE(SE3Manifold().Plus(block(x).data(), xi.data(), moved.data()));
  const Eigen::Vector3d p(1.0, 2.0, 3.0);
  EXPECT_LT((from_pose_block(moved.data()) * p - SE3::exp(xi) * (x * p)).norm(), 1e-14);
}

}  // namespace
}  // namespace ipl_slam
