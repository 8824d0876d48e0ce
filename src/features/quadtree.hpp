#pragma once

#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "features/fast_corners.hpp"

namespace ipl_slam {

/// Picks at most `quota` of `corners` so that they cover `area` evenly: the area is quartered again and again, fullest
/// parts first, until there are as many parts as corners wanted, and every part keeps its strongest corner.
/// Returns indices into `corners`, ascending. All corners must lie inside `area`.
[[nodiscard]] std::vector<int> spread_evenly(std::span<const Corner> corners, const cv::Rect& area, int quota);

}  // namespace ipl_slam
