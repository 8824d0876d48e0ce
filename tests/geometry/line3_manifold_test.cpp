#include "geometry/line3_manifold.hpp"

#include <cmath>
#include <vector>

#include <Eigen/LU>
#include <ceres/manifold_test_utils.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

// At a slant, along an axis, near the origin and through it.
const std::vector<Line3> kLines = {
    *Line3::through({0.3, -0.2, 1.1}, {-2.0, 1.5, 3.7}), *Line3::through({0.0, 2.0, 1.0}, {0.0, 2.0, 5.0}),
    *Line3::through({1e-9, 0.0, 0.0}, {1e-9, 1.0, 1.0}), *Line3::through({0.0, 0.0, 0.0}, {1.0, 2.0, -0.5})};

Eigen::VectorXd block(const Line3& line) {
  Eigen::VectorXd x(kLineBlockSize);
  to_line_block(line, x.data());
  return x;
}

Line3 moved(const Line3& line, const Eigen::Vector4d& delta) {
  Eigen::VectorXd y(kLineBlockSize);
  EXPECT_TRUE(Line3Manifold().Plus(block(line).data(), delta.data(), y.data()));
  return from_line_block(y.data());
}

TEST(LineBlock, comes_back_as_the_line_it_was) {
  for (const Line3& line : kLines) {
    const Line3 back = from_line_block(block(line).data());
    EXPECT_LT((back.moment - line.moment).norm(), 1e-15);
    EXPECT_LT((back.direction - line.direction).norm(), 1e-15);
  }
}

TEST(LineBlock, holds_a_line_to_the_last_digit_where_the_numbers_it_came_from_were_coarse) {
  Line3 coarse = kLines[0];
  coarse.moment = coarse.moment.cast<float>().cast<double>();
  coarse.direction = coarse.direction.cast<float>().cast<double>();
  ASSERT_GT(std::abs(coarse.direction.norm() - 1.0), 1e-10);
  const Line3 line = from_line_block(block(coarse).data());
  EXPECT_NEAR(line.direction.norm(), 1.0, 1e-15);
  EXPECT_NEAR(line.moment.dot(line.direction), 0.0, 1e-15);
  EXPECT_LT((line.moment - kLines[0].moment).norm(), 1e-6);
}

TEST(Line3Manifold, holds_what_ceres_asks_of_a_manifold) {
  // Ceres' own conditions: plus and minus undo each other, and their Jacobians agree with numeric
  // differentiation.
  using namespace ceres;  // the macro below needs its matchers unqualified
  const Line3Manifold manifold;
  for (const Line3& x : kLines)
    for (Line3 y : kLines) {
      // Within the right angle that its steps reach.
      if (x.direction.dot(y.direction) < 0.0) y = {-y.moment, -y.direction};
      for (const double size : {1e-6, 1e-3, 0.3, 2.0}) {
        const Eigen::VectorXd delta = size * Eigen::Vector4d(0.4, -0.6, 0.5, -0.7);
        EXPECT_THAT_MANIFOLD_INVARIANTS_HOLD(manifold, block(x), delta, block(y), 1e-9);
      }
    }
}

TEST(Line3Manifold, moves_a_line_to_a_line) {
  for (const Line3& line : kLines) {
    const Line3 to = moved(line, {0.3, -1.2, 0.7, 0.4});
    EXPECT_NEAR(to.direction.norm(), 1.0, 1e-15);
    EXPECT_NEAR(to.moment.dot(to.direction), 0.0, 1e-15);
  }
}

TEST(Line3Manifold, turns_by_the_first_two_components_and_shifts_by_the_others) {
  for (const Line3& line : kLines) {
    const Line3 turned = moved(line, {0.3, -0.4, 0.0, 0.0});
    EXPECT_NEAR(turned.direction.dot(line.direction), std::cos(std::atan(0.5)), 1e-15);
    EXPECT_NEAR(turned.distance(line.nearest_to_origin()), 0.0, 1e-14);
    const Line3 shifted = moved(line, {0.0, 0.0, 0.3, -0.4});
    EXPECT_LT((shifted.direction - line.direction).norm(), 1e-15);
    EXPECT_NEAR((shifted.nearest_to_origin() - line.nearest_to_origin()).norm(), 0.5, 1e-15);
  }
}

TEST(Line3Manifold, the_points_of_a_line_move_in_proportion_to_the_step) {
  const Eigen::Vector4d delta(0.4, -0.6, 0.5, -0.7);
  for (const Line3& line : kLines) {
    const Eigen::Vector3d p = line.nearest_to_origin() + 3.0 * line.direction;
    // Where the moved line passes the plane through p at a right angle to the line.
    const auto movement = [&](double scale) -> Eigen::Vector3d {
      const Line3 to = moved(line, scale * delta);
      const Eigen::Vector3d q = to.nearest_to(p);
      return q + (p - q).dot(line.direction) / to.direction.dot(line.direction) * to.direction - p;
    };
    EXPECT_GT(movement(1.0).norm(), 0.5);
    EXPECT_LT((movement(2.0) - 2.0 * movement(1.0)).norm(), 1e-13);
  }
}

TEST(Line3Manifold, has_four_degrees_of_freedom_at_every_line) {
  for (const Line3& line : kLines) {
    Eigen::Matrix<double, 6, 4, Eigen::RowMajor> j;
    ASSERT_TRUE(Line3Manifold().PlusJacobian(block(line).data(), j.data()));
    // The shifts have length 1 and so have the directions' parts of the turns: no singular value falls far
    // below.
    EXPECT_GT(j.jacobiSvd().singularValues()[3], 0.2);
  }
}

TEST(Line3Manifold, no_step_leads_to_a_line_at_a_right_angle_or_the_other_way) {
  const Line3 line = kLines[1], across = *Line3::through({0.0, 2.0, 1.0}, {1.0, 2.0, 1.0}),
              back{-line.moment, -line.direction};
  Eigen::Vector4d delta;
  EXPECT_FALSE(Line3Manifold().Minus(block(across).data(), block(line).data(), delta.data()));
  EXPECT_FALSE(Line3Manifold().Minus(block(back).data(), block(line).data(), delta.data()));
}

}  // namespace
}  // namespace ipl_slam
