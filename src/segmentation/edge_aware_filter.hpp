#pragma once

#include <opencv2/core.hpp>

namespace ipl_slam {

/// How easily values pass from a cell to the next one, 0 (never) to 1, CV_32FC1.
struct Conductance {
  cv::Mat to_right;  ///< between (x, y) and (x + 1, y); the last column is not used
  cv::Mat to_below;  ///< between (x, y) and (x, y + 1); the last row is not used
};

/// Smooths an image (CV_32FC with any number of channels) along surfaces, in place: each pass is a first
/// order recursive filter to the right, left, down and up whose memory is the conductance (Gastal and
/// Oliveira, "Domain transform for edge-aware image and video processing", ACM TOG 2011, section 4.4).
void filter_along_surfaces(cv::Mat& image, const Conductance& conductance, int passes);

}  // namespace ipl_slam
