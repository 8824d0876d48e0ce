#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "common/random.hpp"

namespace ipl_slam {
namespace {

TEST(Random, GivesTheSameNumbersForTheSameSeedAndOthersForAnother) {
  Random a(7);
  Random b(7);
  Random c(8);
  int equal = 0;
  for (int i = 0; i < 1000; ++i) {
    const std::uint64_t value = a.bits();
    ASSERT_EQ(value, b.bits());
    equal += value == c.bits();
  }
  EXPECT_EQ(equal, 0);
}

TEST(Random, TheSeedOfTheRunChangesEveryStreamAndZeroNone) {
  for (std::uint64_t own = 0; own < 100; ++own) {
    EXPECT_EQ(seeded(own, 0), own);
    EXPECT_NE(seeded(own, 1), own);
    EXPECT_NE(seeded(own, 1), seeded(own, 2));
    EXPECT_NE(seeded(own, 1), seeded(own + 1, 1));
  }
}

TEST(Random, UniformIntegersReachBothEndsEquallyOften) {
  Random random(1);
  std::vector<int> count(7, 0);
  constexpr int kDraws = 70000;
  for (int i = 0; i < kDraws; ++i) {
    const int value = random.uniform_int(-3, 3);
    ASSERT_GE(value, -3);
    ASSERT_LE(value, 3);
    ++count[value + 3];
  }
  // Deviation of each count is sqrt(70000 * 1/7 * 6/7) = 93: five of them.
  for (const int n : count) EXPECT_NEAR(n, kDraws / 7, 465);
}

TEST(Random, UniformNumbersStayInRangeAndFillIt) {
  Random random(2);
  double sum = 0.0;
  double low = 1.0;
  double high = 0.0;
  for (int i = 0; i < 100000; ++i) {
    const double value = random.uniform();
    ASSERT_GE(value, 0.0);
    ASSERT_LT(value, 1.0);
    sum += value;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  EXPECT_NEAR(sum / 100000, 0.5, 5 * 0.289 / std::sqrt(100000.0));  // five standard errors
  EXPECT_LT(low, 1e-3);
  EXPECT_GT(high, 1.0 - 1e-3);
}

TEST(Random, NormalNumbersHaveTheAskedMeanAndDeviation) {
  Random random(3);
  constexpr int kDraws = 100000;
  double sum = 0.0;
  double squares = 0.0;
  int beyond_two = 0;
  for (int i = 0; i < kDraws; ++i) {
    const double z = (random.normal(5.0, 2.0) - 5.0) / 2.0;
    sum += z;
    squares += z * z;
    beyond_two += std::abs(z) > 2.0;
  }
  EXPECT_NEAR(sum / kDraws, 0.0, 5 / std::sqrt(double{kDraws}));
  EXPECT_NEAR(squares / kDraws, 1.0, 5 * std::sqrt(2.0 / kDraws));
  EXPECT_NEAR(static_cast<double>(beyond_two) / kDraws, 0.0455,
              0.0035);  // share beyond two deviations, five errors
}

TEST(Random, FastNormalNumbersHaveMeanZeroAndDeviationOne) {
  constexpr int kDraws = 100000;
  double sum = 0.0;
  double squares = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    const double z = fast_normal_from_bits(hash64(4, i));
    sum += z;
    squares += z * z;
  }
  EXPECT_NEAR(sum / kDraws, 0.0, 5 / std::sqrt(double{kDraws}));
  EXPECT_NEAR(squares / kDraws, 1.0, 5 * std::sqrt(2.0 / kDraws));
}

TEST(Random, ShufflingKeepsEveryElementAndChangesTheOrder) {
  std::vector<int> items(100);
  std::iota(items.begin(), items.end(), 0);
  const std::vector<int> before = items;
  Random random(5);
  random.shuffle(items);
  EXPECT_NE(items, before);
  std::sort(items.begin(), items.end());
  EXPECT_EQ(items, before);
}

}  // namespace
}  // namespace ipl_slam
