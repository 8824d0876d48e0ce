#include "dynamics/adaptive_weights.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

using Distances = std::vector<std::optional<double>>;
using Weights = std::vector<double>;

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST(PointWeights, FallLinearlyFromTheSmallestToTheLargestDistance) {
  // (0.05 - d) / (0.05 - 0.01); all numbers are exact up to rounding of the decimal fractions.
  const Weights w = point_weights(Distances{0.01, 0.02, 0.03, 0.04, 0.05}, 0.0);
  const Weights expected{1.0, 0.75, 0.5, 0.25, 0.0};
  ASSERT_EQ(w.size(), expected.size());
  for (std::size_t i = 0; i < w.size(); ++i) EXPECT_NEAR(w[i], expected[i], 1e-15) << i;
}

TEST(PointWeights, BelowTheLeastAreZeroAndAtItAreKept) {
  const Distances distances{0.0, 1.0, 0.75, 0.875};  // weights 1, 0, 1/4, 1/8
  EXPECT_EQ(point_weights(distances, 0.25), (Weights{1.0, 0.0, 0.25, 0.0}));
}

TEST(PointWeights, AreOneWhereTheDistanceIsNotKnown) {
  EXPECT_EQ(point_weights(Distances{0.0, std::nullopt, 4.0, 1.0}, 0.05), (Weights{1.0, 1.0, 0.0, 0.75}));
}

TEST(PointWeights, TakeWhatIsNoDistanceForNotKnown) {
  // None of them moves d_min = 1 or d_max = 3.
  EXPECT_EQ(point_weights(Distances{kNaN, kInf, -kInf, -1.0, 1.0, 2.0, 3.0}, 0.05),
            (Weights{1.0, 1.0, 1.0, 1.0, 1.0, 0.5, 0.0}));
}

TEST(PointWeights, AreOneWhereAllDistancesAreEqual) {
  EXPECT_EQ(point_weights(Distances{0.3, 0.3, std::nullopt, 0.3}, 0.05), Weights(4, 1.0));
  EXPECT_EQ(point_weights(Distances{0.3}, 0.05), Weights(1, 1.0));
  EXPECT_EQ(point_weights(Distances{0.0, 0.0}, 0.05), Weights(2, 1.0));
}

TEST(PointWeights, AreOneWhereNoDistanceIsKnown) {
  EXPECT_EQ(point_weights(Distances{std::nullopt, kNaN}, 0.05), Weights(2, 1.0));
  EXPECT_TRUE(point_weights({}, 0.05).empty());
}

TEST(PointWeights, BearTheLargestNumbersThereAre) {
  const double most = std::numeric_limits<double>::max();
  EXPECT_EQ(point_weights(Distances{0.0, most / 2.0, most}, 0.05), (Weights{1.0, 0.5, 0.0}));
}

// Three components, chi2 27: 1 standard deviation is full weight, 3 are none.
TEST(ResidualWeight, FallsFromTheNoiseToTheThreshold) {
  EXPECT_EQ(residual_weight(0.0, 3, 27.0, 0.05), 1.0);
  EXPECT_EQ(residual_weight(3.0, 3, 27.0, 0.05), 1.0);
  EXPECT_NEAR(residual_weight(12.0, 3, 27.0, 0.05), 0.5, 1e-15);
  EXPECT_EQ(residual_weight(27.0, 3, 27.0, 0.05), 0.0);
  EXPECT_EQ(residual_weight(1e9, 3, 27.0, 0.05), 0.0);
}

TEST(ResidualWeight, IsZeroBelowTheLeast) {
  EXPECT_EQ(residual_weight(12.0, 3, 27.0, 0.51), 0.0);
  EXPECT_GT(residual_weight(12.0, 3, 27.0, 0.49), 0.0);
}

TEST(ResidualWeight, AThresholdWithinTheNoiseLeavesAllOrNothing) {
  EXPECT_EQ(residual_weight(1.0, 3, 2.0, 0.05), 1.0);
  EXPECT_EQ(residual_weight(2.0, 3, 2.0, 0.05), 0.0);
}

TEST(LineWeight, IsTheCosineOfTheAngle) {
  EXPECT_EQ(line_weight(0.0, 0.1), 1.0);
  EXPECT_NEAR(line_weight(std::numbers::pi / 3.0, 0.1), 0.5, 1e-15);
}

TEST(LineWeight, IsZeroFromARightAngleOn) {
  EXPECT_EQ(line_weight(std::numbers::pi / 2.0 + 1e-9, 0.0), 0.0);
  EXPECT_EQ(line_weight(std::numbers::pi, 0.0), 0.0);
}

TEST(LineWeight, IsZeroBelowTheLeast) {
  EXPECT_EQ(line_weight(std::acos(0.0999), 0.1), 0.0);
  EXPECT_NEAR(line_weight(std::acos(0.1001), 0.1), 0.1001, 1e-12);
}

TEST(LineWeight, IsOneWithoutAMatch) {
  EXPECT_EQ(line_weight(std::nullopt, 0.1), 1.0);
  EXPECT_EQ(line_weight(kNaN, 0.1), 1.0);
  EXPECT_EQ(line_weight(kInf, 0.1), 1.0);
}

}  // namespace
}  // namespace ipl_slam
