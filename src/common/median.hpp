#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace ipl_slam {

/// The value in the middle of at least one value, of an even count the upper of the two. Reorders `values`.
template <class T>
[[nodiscard]] T median(std::vector<T>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace ipl_slam
