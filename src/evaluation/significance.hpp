#pragma once

#include <cstddef>
#include <optional>
#include <span>

namespace ipl_slam {

/// Outcome of a test on paired differences.
struct PairedTest {
  std::size_t pairs = 0;   ///< that the test used
  double statistic = 0.0;  ///< t, or W+, the sum of the ranks of the positive differences
  double p = 1.0;          ///< two-sided: chance of a statistic at least as far out if there is no difference
};

/// Student's t test on paired differences (Student, Biometrika 1908): t = mean / (s / sqrt(n)), n - 1 degrees
/// of freedom. It takes the differences for normally distributed. Nothing where it does not apply: fewer than
/// two pairs, or differences that are all alike.
[[nodiscard]] std::optional<PairedTest> paired_t_test(std::span<const double> differences);

/// Wilcoxon's signed-rank test (Biometrics Bulletin 1945), which takes them for symmetric only. Zero
/// differences are dropped, as Wilcoxon did; equal magnitudes share their mean rank. Up to kExactPairs pairs
/// without ties p is exact, otherwise by the normal approximation with corrections for ties and continuity.
/// Nothing where no pair is left.
[[nodiscard]] std::optional<PairedTest> wilcoxon_signed_rank(std::span<const double> differences);

/// Up to here the normal approximation is not needed, and 2^n is small enough to count.
inline constexpr std::size_t kExactPairs = 25;

/// Regularised incomplete beta function I_x(a, b) for a, b > 0 and x in [0, 1] (DLMF 8.17).
[[nodiscard]] double incomplete_beta(double a, double b, double x);

}  // namespace ipl_slam
