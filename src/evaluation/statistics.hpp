#pragma once

#include <cstddef>
#include <span>

namespace ipl_slam {

/// Summary of a set of values, in the values' own unit.
struct Statistics {
  std::size_t count = 0;
  double rmse = 0.0;  ///< root of the mean square
  double mean = 0.0;
  double median = 0.0;  ///< of an even count the mean of the two in the middle
  double std = 0.0;     ///< see what made it
  double min = 0.0;
  double max = 0.0;
};

/// Of errors of one trajectory: std divides by n, as the TUM benchmark's scripts do. All zero for no values.
[[nodiscard]] Statistics error_statistics(std::span<const double> errors);

/// Of repeated runs, which are a sample of all runs there could be: std divides by n - 1 (0 for a single
/// run).
[[nodiscard]] Statistics run_statistics(std::span<const double> runs);

}  // namespace ipl_slam
