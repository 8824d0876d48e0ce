#include "evaluation/statistics.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

TEST(Statistics, OfErrorsDivideByTheirNumber) {
  const Statistics s = error_statistics(std::vector<double>{4.0, 1.0, 2.0, 5.0});
  EXPECT_EQ(s.count, 4u);
  EXPECT_DOUBLE_EQ(s.mean, 3.0);
  EXPECT_DOUBLE_EQ(s.median, 3.0);
  EXPECT_DOUBLE_EQ(s.std, std::sqrt(10.0 / 4.0));
  EXPECT_DOUBLE_EQ(s.rmse, std::sqrt(46.0 / 4.0));
  EXPECT_EQ(s.min, 1.0);
  EXPECT_EQ(s.max, 5.0);
}

TEST(Statistics, OfRunsDivideByOneLess) {
  const Statistics s = run_statistics(std::vector<double>{4.0, 1.0, 2.0, 5.0});
  EXPECT_DOUBLE_EQ(s.mean, 3.0);
  EXPECT_DOUBLE_EQ(s.std, std::sqrt(10.0 / 3.0));
}

TEST(Statistics, OfOddlyManyValuesHaveTheMiddleOneAsMedian) {
  EXPECT_EQ(error_statistics(std::vector<double>{9.0, 1.0, 2.0}).median, 2.0);
}

TEST(Statistics, OfOneValueOrNoneHaveNoSpread) {
  EXPECT_EQ(run_statistics(std::vector<double>{2.0}).std, 0.0);
  EXPECT_EQ(run_statistics(std::vector<double>{2.0}).mean, 2.0);
  EXPECT_EQ(error_statistics({}).count, 0u);
  EXPECT_EQ(error_statistics({}).mean, 0.0);
}

// The mean is a million times the spread: one pass over the squares would lose it.
TEST(Statistics, KeepASmallSpreadOfLargeValues) {
  EXPECT_NEAR(error_statistics(std::vector<double>{1e9 + 1.0, 1e9 - 1.0}).std, 1.0, 1e-6);
}

}  // namespace
}  // namespace ipl_slam
