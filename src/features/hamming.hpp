#pragma once

#include <limits>
#include <span>
#include <vector>

#include "common/cpu.hpp"
#include "features/features.hpp"

namespace ipl_slam {

/// The closest descriptor of a set and how close the runner-up is.
struct Nearest {
  static constexpr int kNone = std::numeric_limits<int>::max();

  int index = -1;               ///< of the closest, the lowest among equals; -1 in an empty set
  int distance = kNone;         ///< bits
  int second_distance = kNone;  ///< of the second closest; kNone in a set of one
};

/// For each descriptor of `a` its nearest in `b`, and the other way round.
struct TwoNearest {
  std::vector<Nearest> in_b, in_a;
};

/// Compares every pair once. At most 2^20 descriptors a side (std::invalid_argument).
[[nodiscard]] TwoNearest two_nearest(std::span<const Descriptor> a, std::span<const Descriptor> b,
                                     Simd simd = best_simd());

}  // namespace ipl_slam
