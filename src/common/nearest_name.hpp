#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace ipl_slam {

/// Levenshtein distance: the least number of characters to insert, delete or replace; case does not count.
[[nodiscard]] std::size_t edit_distance(std::string_view a, std::string_view b);

/// The candidate with the least edit distance, the first of equals; empty where there is no candidate.
[[nodiscard]] std::string nearest_name(std::string_view name, std::span<const std::string> candidates);

}  // namespace ipl_slam
