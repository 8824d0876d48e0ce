#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "dense/semantic_cloud.hpp"

namespace ipl_slam {

/// A class as it stands in a comment of a cloud file: "label 56 chair 255 0 0". What is blank or a control
/// character in the name becomes one blank.
[[nodiscard]] std::string legend_line(const CloudClass& c);

/// Inverse of legend_line; nothing for other text.
[[nodiscard]] std::optional<CloudClass> parse_legend_line(std::string_view text);

}  // namespace ipl_slam
