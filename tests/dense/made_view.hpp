#pragma once

#include <cstdint>

#include "dense/dense_view.hpp"

namespace ipl_slam::testing {

/// A view with something in each of its images; others for other seeds.
inline DenseView made_view(cv::Size size, int seed) {
  DenseView view;
  view.timestamp = 1000.25 + 0.1 * seed;
  view.color = cv::Mat(size, CV_8UC3);
  view.depth = cv::Mat(size, CV_16UC1);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      view.color.at<cv::Vec3b>(y, x) =
          cv::Vec3b(static_cast<std::uint8_t>(2 * x), static_cast<std::uint8_t>(3 * y),
                    static_cast<std::uint8_t>(40 * seed));
      view.depth.at<std::uint16_t>(y, x) =
          static_cast<std::uint16_t>((x + y) % 11 == 0 ? 0 : 5000 + 7 * (x / 3) + 100 * seed);
    }
  }
  view.labels = cv::Mat::zeros(size, CV_8UC1);
  view.labels(cv::Rect(3, 4, 12, 10)) = 1;
  view.labels(cv::Rect(20, 10, 9, 11)) = 2;
  view.instances = {{InstanceId{7}, "person", 0.87F},
                    {InstanceId{static_cast<std::uint32_t>(10 + seed)}, "dining table", 0.1F}};
  return view;
}

inline bool equal(const cv::Mat& a, const cv::Mat& b) {
  return a.type() == b.type() && a.size() == b.size() && cv::norm(a, b, cv::NORM_INF) == 0.0;
}

}  // namespace ipl_slam::testing
