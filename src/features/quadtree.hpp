#pragma once

#include <span>
#include <vector>

#include <opencv2/core.hpp>

#include "features/fast_corners.hpp"

namespace ipl_slam {

/// Picks at most `quota` of `corners`, indices ascending. The share `spread` (0..1) of them covers `area`
/// evenly: the area is quartered again and again, fullest parts first, until there are as many parts as
/// corners wanted, and every part keeps its strongest corner. The rest are the strongest of those left. Even
/// cover conditions the pose well, strong corners are found again more often. All corners must lie inside
/// `area`.
[[nodiscard]] std::vector<int> spread_evenly(std::span<const Corner> corners, const cv::Rect& area, int quota,
                                             double spread);

}  // namespace ipl_slam
