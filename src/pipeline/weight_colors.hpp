#pragma once

#include <opencv2/core.hpp>

namespace ipl_slam {

/// Colours (BGR) of features in pictures, by weight: red = low, as in the paper's figure 12. Weights beyond 0
/// to 1 are taken for the nearer end.
[[nodiscard]] cv::Scalar point_color(double weight);  ///< red, yellow, green
[[nodiscard]] cv::Scalar line_color(double weight);   ///< red, purple, blue

inline const cv::Scalar kUnmatchedColor(150, 150, 150);

}  // namespace ipl_slam
