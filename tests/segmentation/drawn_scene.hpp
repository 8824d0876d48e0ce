#pragma once

#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "common/random.hpp"
#include "dataset/rgbd_frame.hpp"
#include "geometry/camera.hpp"
#include "segmentation/instance.hpp"

namespace ipl_slam::test {

inline Camera drawn_camera() {
  return {.width = 320, .height = 240, .fx = 262.5, .fy = 262.5, .cx = 159.5, .cy = 119.5};
}

/// A random pattern with detail of several pixels, brightness about a colour.
inline cv::Mat pattern(std::uint64_t seed, cv::Size size, const cv::Scalar& color) {
  Random random(seed);
  cv::Mat picture(size, CV_8UC3, color);
  for (int i = 0; i < size.area() / 40; ++i) {
    const cv::Point at(static_cast<int>(random.index(static_cast<std::uint64_t>(size.width))),
                       static_cast<int>(random.index(static_cast<std::uint64_t>(size.height))));
    const double light = random.uniform(-45.0, 45.0);
    cv::rectangle(
        picture, at,
        at + cv::Point(3 + static_cast<int>(random.index(6)), 3 + static_cast<int>(random.index(6))),
        color + cv::Scalar(light, light, light), cv::FILLED);
  }
  return picture;
}

/// An upright ellipse, textured, at some depth; what is nearer hides what is farther.
struct Figure {
  cv::Point centre;
  double depth = 2.0;  ///< m
  std::uint64_t seed = 1;
  cv::Scalar color{120, 120, 120};
  cv::Size half{28, 70};
  std::string class_name = "person";
};

struct DrawnFrame {
  RgbdFrame rgbd;
  std::vector<Instance> instances;  ///< of the figures in their order; empty masks where nothing shows
};

/// Figures before a textured wall 4 m away that the camera's pan has shifted by `pan` pixels.
inline DrawnFrame draw(std::size_t index, std::vector<Figure> figures, int pan = 0) {
  const Camera camera = drawn_camera();
  const cv::Size size(camera.width, camera.height);
  static const cv::Mat wall = pattern(99, {960, 240}, {150, 140, 130});
  DrawnFrame frame;
  frame.rgbd.index = index;
  frame.rgbd.timestamp = static_cast<double>(index) / 30.0;
  frame.rgbd.color = wall(cv::Rect(320 + pan, 0, size.width, size.height)).clone();
  frame.rgbd.depth = cv::Mat(size, CV_16UC1, cv::Scalar(4.0 * camera.depth_scale));
  cv::Mat owner(size, CV_8UC1, cv::Scalar(0));
  for (std::size_t i = 0; i < figures.size(); ++i) {
    const Figure& f = figures[i];
    const cv::Mat skin = pattern(f.seed, f.half * 2, f.color);
    for (int y = -f.half.height; y < f.half.height; ++y) {
      for (int x = -f.half.width; x < f.half.width; ++x) {
        const double u = static_cast<double>(x) / f.half.width, v = static_cast<double>(y) / f.half.height;
        const cv::Point p = f.centre + cv::Point(x, y);
        if (u * u + v * v > 1.0 || !cv::Rect({}, size).contains(p)) continue;
        const auto raw = static_cast<std::uint16_t>(f.depth * camera.depth_scale);
        if (frame.rgbd.depth.at<std::uint16_t>(p) < raw) continue;
        frame.rgbd.depth.at<std::uint16_t>(p) = raw;
        frame.rgbd.color.at<cv::Vec3b>(p) = skin.at<cv::Vec3b>(y + f.half.height, x + f.half.width);
        owner.at<std::uint8_t>(p) = static_cast<std::uint8_t>(i + 1);
      }
    }
  }
  for (std::size_t i = 0; i < figures.size(); ++i) {
    const BitMask mask = BitMask::from_image(owner == static_cast<int>(i + 1));
    frame.instances.push_back({figures[i].class_name, 0.9F, mask.bounding_box(), mask});
  }
  return frame;
}

}  // namespace ipl_slam::test
