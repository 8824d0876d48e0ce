#include "evaluation/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace ipl_slam {
namespace {

Statistics summarise(std::span<const double> values, std::size_t lost_degrees_of_freedom) {
  Statistics result;
  result.count = values.size();
  if (values.empty()) return result;
  const double n = static_cast<double>(values.size());

  double sum = 0.0, squares = 0.0;
  for (const double v : values) sum += v, squares += v * v;
  result.mean = sum / n;
  result.rmse = std::sqrt(squares / n);

  double deviations = 0.0;  // from the mean, in a second pass: exact where the first would cancel
  for (const double v : values) deviations += (v - result.mean) * (v - result.mean);
  const double divisor = n - static_cast<double>(lost_degrees_of_freedom);
  result.std = divisor > 0.0 ? std::sqrt(deviations / divisor) : 0.0;

  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  result.min = sorted.front();
  result.max = sorted.back();
  result.median = 0.5 * (sorted[(sorted.size() - 1) / 2] + sorted[sorted.size() / 2]);
  return result;
}

}  // namespace

Statistics error_statistics(std::span<const double> errors) {
  return summarise(errors, 0);
}

Statistics run_statistics(std::span<const double> runs) {
  return summarise(runs, 1);
}

}  // namespace ipl_slam
