#pragma once

#include <opencv2/core.hpp>

#include "common/cpu.hpp"

namespace ipl_slam {

/// Smooths an 8-bit image with a 7x7 Gaussian of sigma 2 pixels, the smoothing the binary tests of the
/// descriptor are made for (Rublee et al., "ORB: an efficient alternative to SIFT or SURF", ICCV 2011).
/// Weights are integers of 1/128 and each of the two passes rounds to 8 bits: less than one grey level off
/// the exact filter, and several times faster. Border pixels are repeated outwards. `out` must have the
/// image's size and type and be another image. Throws std::invalid_argument otherwise.
void gaussian_blur_7x7(const cv::Mat& image, cv::Mat& out, Simd simd = best_simd());

}  // namespace ipl_slam
