#pragma once

#include <opencv2/core.hpp>

#include "common/random.hpp"

namespace ipl_slam::test {

/// CV_8UC1; about half of the pixels are 0, the others any value from 1 to 255.
inline cv::Mat random_mask_image(cv::Size size, std::uint64_t seed) {
  cv::Mat image(size, CV_8UC1);
  Random random(seed);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      image.at<std::uint8_t>(y, x) =
          static_cast<std::uint8_t>(random.chance(0.5) ? random.uniform_int(1, 255) : 0);
    }
  }
  return image;
}

}  // namespace ipl_slam::test
