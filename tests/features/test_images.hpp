#pragma once

#include <cstdint>
#include <random>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "geometry/camera.hpp"

namespace ipl_slam::test {

/// Grey image of overlapping random rectangles, slightly smoothed: corners of every contrast all over.
inline cv::Mat textured_image(int width, int height, unsigned seed = 1, int rectangles = 700) {
  std::mt19937 random(seed);
  const auto below = [&random](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  cv::Mat image(height, width, CV_8UC1, cv::Scalar(128));
  for (int i = 0; i < rectangles; ++i) {
    const cv::Rect r(below(width) - 10, below(height) - 10, 6 + below(60), 6 + below(60));
    cv::rectangle(image, r, cv::Scalar(below(256)), cv::FILLED);
  }
  cv::GaussianBlur(image, image, {3, 3}, 0.8);
  return image;
}

/// Every pixel independent: the densest possible input for the vector code.
inline cv::Mat noise_image(int width, int height, unsigned seed = 1) {
  std::mt19937 random(seed);
  cv::Mat image(height, width, CV_8UC1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(random() >> 13);
  }
  return image;
}

inline cv::Mat constant_depth(int width, int height, int raw) {
  return {height, width, CV_16UC1, cv::Scalar(raw)};
}

/// Pinhole camera without distortion for images of this size.
inline Camera simple_camera(int width, int height) {
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = 0.8 * width;
  camera.cx = 0.5 * (width - 1);
  camera.cy = 0.5 * (height - 1);
  return camera;
}

}  // namespace ipl_slam::test
