#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

namespace ipl_slam {

/// Gradients of an image, in units of 1 / kEdgeGradientUnit grey values per pixel, and the pixels where their
/// magnitude is largest across the edge. The outermost pixels have none.
struct EdgeMap {
  int width = 0, height = 0;
  std::vector<std::int16_t> gx, gy;     ///< to the right and downwards, towards the brighter side
  std::vector<std::int16_t> magnitude;  ///< |gx| + |gy|, 0 on the border
  std::vector<std::uint8_t> is_ridge;   ///< 1 where magnitude is a local maximum across the edge, else 0

  /// Whether the edge at this pixel runs rather along the u-axis than along the v-axis.
  [[nodiscard]] bool runs_along_u(std::size_t i) const {
    return (gy[i] < 0 ? -gy[i] : gy[i]) >= (gx[i] < 0 ? -gx[i] : gx[i]);
  }
};

/// Sobel's operator (8) on grey values with four more bits (16).
inline constexpr int kEdgeGradientUnit = 128;

/// Smooths `grey` (CV_8UC1, at least 3x3) with the 5x5 binomial kernel (a Gaussian of sigma 1) and takes
/// Sobel gradients. Ridges are looked for where the magnitude is at least `min_magnitude`. `map` keeps its
/// memory from call to call.
void compute_edge_map(const cv::Mat& grey, int min_magnitude, EdgeMap& map);

}  // namespace ipl_slam
