#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "common/random.hpp"
#include "segmentation/instance.hpp"
#include "support/synthetic_world.hpp"

namespace ipl_slam::test {

/// 108 points on a grid that a camera at the origin sees at (40 + 50 i, 40 + 50 j), i = 0..11, j = 0..8, in
/// depths of 2 to 2.9 m, each with a descriptor of its own. Keypoint k of every frame is point k = 9 i + j;
/// all are on level 0.
class PointGrid {
 public:
  static constexpr std::size_t kColumns = 12, kRows = 9, kSize = kColumns * kRows;

  PointGrid() {
    Random random(1);
    for (std::size_t i = 0; i < kColumns; ++i) {
      for (std::size_t j = 0; j < kRows; ++j) {
        const double depth = 2.0 + 0.1 * static_cast<double>((3 * i + 5 * j + i * j) % 10);
        positions.push_back(kTestCamera.unproject(uv(i, j), depth));
        descriptors.push_back({random.bits(), random.bits(), random.bits(), random.bits()});
      }
    }
  }

  [[nodiscard]] static Eigen::Vector2d uv(std::size_t i, std::size_t j) {
    return {40.0 + 50.0 * static_cast<double>(i), 40.0 + 50.0 * static_cast<double>(j)};
  }
  [[nodiscard]] static std::size_t at(std::size_t i, std::size_t j) { return kRows * i + j; }

  /// What a camera at T_cw sees of the points as they lie at present.
  [[nodiscard]] Features look(const SE3& T_cw = {}) const {
    Features features;
    features.descriptors = descriptors;
    for (const Eigen::Vector3d& position : positions) {
      const Eigen::Vector3d p_c = T_cw * position;
      Keypoint keypoint;
      keypoint.pixel = keypoint.undistorted = kTestCamera.project(p_c).cast<float>();
      keypoint.depth = static_cast<float>(p_c.z());
      features.keypoints.push_back(keypoint);
    }
    return features;
  }

  std::vector<Eigen::Vector3d> positions;  // world, m
  std::vector<Descriptor> descriptors;
};

/// Columns first <= x < last, rows first <= y < last of the test camera's image.
inline BitMask box_mask(const cv::Rect& box) {
  BitMask mask(cv::Size(kTestCamera.width, kTestCamera.height));
  for (int y = box.y; y < box.y + box.height; ++y) mask.set_run(y, box.x, box.x + box.width);
  return mask;
}

inline TrackedInstance box_instance(std::uint32_t id, const char* class_name, const cv::Rect& box) {
  return {InstanceId{id}, {class_name, 0.9F, box, box_mask(box)}};
}

}  // namespace ipl_slam::test
