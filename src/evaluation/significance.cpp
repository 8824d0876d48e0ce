#include "evaluation/significance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "evaluation/statistics.hpp"

namespace ipl_slam {
namespace {

// The continued fraction of DLMF 8.17.22, 1/(1 + d1/(1 + d2/(1 + ...))), by the modified Lentz method
// (Thompson and Barnett, Journal of Computational Physics 1986). Converges fast for x < (a+1)/(a+b+2).
double beta_fraction(double a, double b, double x) {
  constexpr double tiny = 1e-300;  // stands for a denominator of zero
  constexpr int most_terms = 10000;
  const auto coefficient = [&](int n) {
    const double m = n / 2;
    if (n % 2 == 0) return m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m));
    return -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
  };
  const auto away_from_zero = [](double value) { return std::abs(value) < tiny ? tiny : value; };
  double f = 1.0, c = 1.0, d = 0.0;
  for (int n = 1; n <= most_terms; ++n) {
    const double dn = coefficient(n);
    d = 1.0 / away_from_zero(1.0 + dn * d);
    c = away_from_zero(1.0 + dn / c);
    f *= c * d;
    if (std::abs(c * d - 1.0) < std::numeric_limits<double>::epsilon()) break;
  }
  return 1.0 / f;
}

// P(|T| >= |t|) for Student's distribution.
double two_sided_t(double t, double degrees_of_freedom) {
  return incomplete_beta(0.5 * degrees_of_freedom, 0.5, degrees_of_freedom / (degrees_of_freedom + t * t));
}

struct Ranks {
  std::vector<double> rank;   // of each difference's magnitude, from 1
  double tie_correction = 0;  // sum of t^3 - t over groups of t equal magnitudes
};

Ranks rank_magnitudes(const std::vector<double>& differences) {
  std::vector<std::size_t> order(differences.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto magnitude = [&](std::size_t i) { return std::abs(differences[i]); };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return magnitude(a) < magnitude(b); });
  Ranks ranks;
  ranks.rank.resize(differences.size());
  for (std::size_t first = 0, last = 0; first < order.size(); first = last) {
    while (last < order.size() && magnitude(order[last]) == magnitude(order[first])) ++last;
    const double shared = 0.5 * static_cast<double>(first + 1 + last);  // mean of ranks first+1 .. last
    for (std::size_t i = first; i < last; ++i) ranks.rank[order[i]] = shared;
    const double t = static_cast<double>(last - first);
    ranks.tie_correction += t * t * t - t;
  }
  return ranks;
}

// P(W+ <= w) counted over all 2^n signs: in how many of them the positive ranks add up to at most w.
double exact_lower_tail(std::size_t n, double w) {
  std::vector<double> ways(n * (n + 1) / 2 + 1, 0.0);  // ways[s]: subsets of the ranks so far with sum s
  ways[0] = 1.0;
  for (std::size_t rank = 1; rank <= n; ++rank) {
    for (std::size_t s = ways.size() - 1; s >= rank; --s) ways[s] += ways[s - rank];
  }
  const auto end = ways.begin() + static_cast<std::ptrdiff_t>(std::floor(w)) + 1;
  return std::accumulate(ways.begin(), end, 0.0) / std::exp2(static_cast<double>(n));
}

double approximate_p(double n, double w, double tie_correction) {
  const double mean = n * (n + 1) / 4;
  const double deviation = std::sqrt(n * (n + 1) * (2 * n + 1) / 24 - tie_correction / 48);
  const double z = std::max(std::abs(w - mean) - 0.5, 0.0) / deviation;
  return std::erfc(z / std::sqrt(2.0));
}

}  // namespace

double incomplete_beta(double a, double b, double x) {
  if (!(a > 0.0 && b > 0.0 && x >= 0.0 && x <= 1.0)) {
    throw std::invalid_argument("incomplete_beta: a, b > 0 and x in [0, 1] are wanted");
  }
  if (x == 0.0 || x == 1.0) return x;
  const double factor =
      std::exp(a * std::log(x) + b * std::log1p(-x) + std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b));
  if (x < (a + 1) / (a + b + 2)) return factor * beta_fraction(a, b, x) / a;
  return 1.0 - factor * beta_fraction(b, a, 1.0 - x) / b;
}

std::optional<PairedTest> paired_t_test(std::span<const double> differences) {
  const Statistics s = run_statistics(differences);
  if (s.count < 2) return std::nullopt;
  const double error = s.std / std::sqrt(static_cast<double>(s.count));
  // A spread of rounding alone would make t a large number that means nothing.
  if (error <= 10 * std::numeric_limits<double>::epsilon() * std::abs(s.mean)) return std::nullopt;
  const double t = s.mean / error;
  return PairedTest{s.count, t, two_sided_t(t, static_cast<double>(s.count - 1))};
}

std::optional<PairedTest> wilcoxon_signed_rank(std::span<const double> differences) {
  std::vector<double> kept;
  std::copy_if(differences.begin(), differences.end(), std::back_inserter(kept),
               [](double d) { return d != 0.0; });
  if (kept.empty()) return std::nullopt;
  const Ranks ranks = rank_magnitudes(kept);
  double positive = 0.0;
  for (std::size_t i = 0; i < kept.size(); ++i) positive += kept[i] > 0.0 ? ranks.rank[i] : 0.0;

  const double n = static_cast<double>(kept.size());
  if (kept.size() > kExactPairs || ranks.tie_correction > 0.0) {
    return PairedTest{kept.size(), positive, approximate_p(n, positive, ranks.tie_correction)};
  }
  const double smaller = std::min(positive, n * (n + 1) / 2 - positive);
  return PairedTest{kept.size(), positive, std::min(1.0, 2.0 * exact_lower_tail(kept.size(), smaller))};
}

}  // namespace ipl_slam
