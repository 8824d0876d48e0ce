#include "evaluation/significance.hpp"

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

TEST(IncompleteBeta, HasItsClosedForms) {
  // I_x(1, b) = 1 - (1-x)^b, I_x(a, 1) = x^a, I_x(1/2, 1/2) = 2/pi asin(sqrt x).
  for (const double x : {0.001, 0.2, 0.5, 0.9, 0.999}) {
    EXPECT_NEAR(incomplete_beta(1.0, 3.5, x), 1.0 - std::pow(1.0 - x, 3.5), 1e-14);
    EXPECT_NEAR(incomplete_beta(4.0, 1.0, x), std::pow(x, 4.0), 1e-14);
    EXPECT_NEAR(incomplete_beta(0.5, 0.5, x), 2.0 / std::numbers::pi * std::asin(std::sqrt(x)), 1e-14);
    EXPECT_NEAR(incomplete_beta(2.5, 7.0, x), 1.0 - incomplete_beta(7.0, 2.5, 1.0 - x), 1e-14);
  }
  EXPECT_EQ(incomplete_beta(2.0, 3.0, 0.0), 0.0);
  EXPECT_EQ(incomplete_beta(2.0, 3.0, 1.0), 1.0);
  EXPECT_THROW((void)incomplete_beta(0.0, 1.0, 0.5), std::invalid_argument);
  EXPECT_THROW((void)incomplete_beta(1.0, 1.0, 1.5), std::invalid_argument);
}

// Student's own sleep data (1908), which R ships: t.test(..., paired = TRUE) prints these.
TEST(PairedTTest, OfTheSleepDataIsAsPublished) {
  const std::vector<double> differences = {-1.2, -2.4, -1.3, -1.3, 0.0, -1.0, -1.8, -0.8, -4.6, -1.4};
  const auto test = paired_t_test(differences);
  ASSERT_TRUE(test);
  EXPECT_EQ(test->pairs, 10u);
  EXPECT_NEAR(test->statistic, -4.0621, 5e-5);
  EXPECT_NEAR(test->p, 0.002833, 5e-7);
}

// One degree of freedom is the Cauchy distribution, two have p = 1 - t / sqrt(2 + t^2).
TEST(PairedTTest, OfTwoAndThreePairsHasItsClosedForm) {
  const auto two = paired_t_test(std::vector<double>{1.0, 3.0});  // mean 2, s sqrt(2), t 2
  ASSERT_TRUE(two);
  EXPECT_NEAR(two->statistic, 2.0, 1e-12);
  EXPECT_NEAR(two->p, 1.0 - 2.0 / std::numbers::pi * std::atan(2.0), 1e-12);
  const auto three = paired_t_test(std::vector<double>{1.0, 2.0, 3.0});  // t = 2 sqrt(3)
  ASSERT_TRUE(three);
  EXPECT_NEAR(three->p, 1.0 - three->statistic / std::sqrt(2.0 + 12.0), 1e-12);
}

TEST(PairedTTest, OfDifferencesThatCancelFindsNothing) {
  const auto test = paired_t_test(std::vector<double>{-1.0, 1.0, -2.0, 2.0});
  ASSERT_TRUE(test);
  EXPECT_EQ(test->statistic, 0.0);
  EXPECT_EQ(test->p, 1.0);
}

TEST(PairedTTest, DoesNotApplyWithoutPairsOrSpread) {
  EXPECT_FALSE(paired_t_test({}));
  EXPECT_FALSE(paired_t_test(std::vector<double>{1.0}));
  EXPECT_FALSE(paired_t_test(std::vector<double>{0.0, 0.0, 0.0}));
  EXPECT_FALSE(paired_t_test(std::vector<double>{0.1, 0.1, 0.1, 0.1}));
}

// Hamilton depression scale before and after (Hollander and Wolfe 1973, the example of R's wilcox.test): V =
// 40, one-sided p = 0.01953 = 10 / 512.
TEST(Wilcoxon, OfTheDepressionDataIsAsPublished) {
  const std::vector<double> before = {1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30},
                            after = {0.878, 0.647, 0.598, 2.05, 1.06, 1.29, 1.06, 3.14, 1.29};
  std::vector<double> differences;
  for (std::size_t i = 0; i < before.size(); ++i) differences.push_back(before[i] - after[i]);
  const auto test = wilcoxon_signed_rank(differences);
  ASSERT_TRUE(test);
  EXPECT_EQ(test->pairs, 9u);
  EXPECT_EQ(test->statistic, 40.0);
  EXPECT_DOUBLE_EQ(test->p, 2 * 10.0 / 512.0);
}

TEST(Wilcoxon, OfFewPairsCountsTheSigns) {
  // Of 16 choices of signs, one has W+ = 10 and one W+ = 0.
  EXPECT_DOUBLE_EQ(wilcoxon_signed_rank(std::vector<double>{1.0, 2.0, 3.0, 4.0})->p, 2.0 / 16.0);
  EXPECT_DOUBLE_EQ(wilcoxon_signed_rank(std::vector<double>{-1.0, -2.0, -3.0, -4.0})->p, 2.0 / 16.0);
  // W+ = 9: {} and {1} are as far out below.
  EXPECT_DOUBLE_EQ(wilcoxon_signed_rank(std::vector<double>{-1.0, 2.0, 3.0, 4.0})->p, 4.0 / 16.0);
  // In the middle both tails together would count more than everything.
  EXPECT_DOUBLE_EQ(wilcoxon_signed_rank(std::vector<double>{1.0, -2.0, -3.0, 4.0})->p, 1.0);
}

TEST(Wilcoxon, DropsZeroDifferences) {
  const auto test = wilcoxon_signed_rank(std::vector<double>{0.0, 1.0, 2.0, 0.0, 3.0, 4.0});
  ASSERT_TRUE(test);
  EXPECT_EQ(test->pairs, 4u);
  EXPECT_DOUBLE_EQ(test->p, 2.0 / 16.0);
}

// Magnitudes 1 1 2 3: ranks 1.5 1.5 3 4; W+ = 8.5, mean 5, variance 4*5*9/24 - (2^3 - 2)/48 = 7.375,
// z = (3.5 - 0.5) / sqrt(7.375).
TEST(Wilcoxon, WithTiesIsApproximatedWithBothCorrections) {
  const auto test = wilcoxon_signed_rank(std::vector<double>{1.0, -1.0, 2.0, 3.0});
  ASSERT_TRUE(test);
  EXPECT_DOUBLE_EQ(test->statistic, 8.5);
  EXPECT_NEAR(test->p, std::erfc(3.0 / std::sqrt(7.375) / std::numbers::sqrt2), 1e-14);
}

// Every third of the ranks 1 to n negative; p by the normal approximation, continuity corrected, which is
// good to about 2 % at the last n that is counted.
TEST(Wilcoxon, OfManyPairsIsApproximatedAndAgreesWithTheExactOne) {
  for (const auto& [n, tolerance] : {std::pair(25, 0.003), std::pair(26, 1e-14)}) {
    std::vector<double> differences;
    double positive = 0.0;
    for (int i = 1; i <= n; ++i) {
      differences.push_back(i % 3 == 0 ? -i : i);
      positive += i % 3 == 0 ? 0.0 : i;
    }
    const double mean = n * (n + 1) / 4.0, deviation = std::sqrt(n * (n + 1) * (2 * n + 1) / 24.0);
    const double p = std::erfc((positive - mean - 0.5) / deviation / std::numbers::sqrt2);
    EXPECT_NEAR(wilcoxon_signed_rank(differences)->p, p, tolerance) << n;
  }
}

TEST(Wilcoxon, IsDefinedWithoutPairs) {
  EXPECT_FALSE(wilcoxon_signed_rank({}));
  EXPECT_FALSE(wilcoxon_signed_rank(std::vector<double>{0.0, 0.0}));
  EXPECT_DOUBLE_EQ(wilcoxon_signed_rank(std::vector<double>{-0.5})->p, 1.0);
  // All magnitudes alike: nothing but signs, and a variance that is not zero.
  const auto alike = wilcoxon_signed_rank(std::vector<double>{0.1, 0.1, 0.1});
  ASSERT_TRUE(alike);
  EXPECT_GT(alike->p, 0.0);
  EXPECT_LT(alike->p, 1.0);
}

}  // namespace
}  // namespace ipl_slam
