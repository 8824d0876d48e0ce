#include "dataset/association.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace ipl_slam {

std::vector<std::pair<std::size_t, std::size_t>> associate(std::span<const double> first,
                                                           std::span<const double> second,
                                                           double max_difference) {
  // (difference, first, second): the stamps increase, so ordering indices orders the stamps.
  std::vector<std::tuple<double, std::size_t, std::size_t>> candidates;
  std::size_t window_begin = 0;
  for (std::size_t i = 0; i < first.size(); ++i) {
    while (window_begin < second.size() && second[window_begin] < first[i] &&
           !(std::abs(first[i] - second[window_begin]) < max_difference)) {
      ++window_begin;
    }
    for (std::size_t j = window_begin; j < second.size(); ++j) {
      const double difference = std::abs(first[i] - second[j]);
      if (!(difference < max_difference)) break;
      candidates.emplace_back(difference, i, j);
    }
  }
  std::sort(candidates.begin(), candidates.end());

  std::vector<bool> first_used(first.size()), second_used(second.size());
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (const auto& [difference, i, j] : candidates) {
    if (first_used[i] || second_used[j]) continue;
    first_used[i] = second_used[j] = true;
    pairs.emplace_back(i, j);
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace ipl_slam
