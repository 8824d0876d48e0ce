#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace ipl_slam {

/// 256-bit binary descriptor.
using Descriptor = std::array<std::uint64_t, 4>;

/// Number of differing bits, 0..256.
[[nodiscard]] inline int hamming_distance(const Descriptor& a, const Descriptor& b) {
  return std::popcount(a[0] ^ b[0]) + std::popcount(a[1] ^ b[1]) + std::popcount(a[2] ^ b[2]) +
         std::popcount(a[3] ^ b[3]);
}

/// One ORB keypoint. Pixel coordinates are of the full-size image, whatever the pyramid level it was found
/// on.
struct Keypoint {
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();        ///< as it lies in the image (distorted)
  Eigen::Vector2f undistorted = Eigen::Vector2f::Zero();  ///< with the lens distortion removed
  float angle = 0.0F;                                     ///< orientation, radians in [0, 2 pi)
  float response = 0.0F;                                  ///< corner score
  float depth = 0.0F;                                     ///< metres along the optical axis; 0 = none
  int level = 0;                                          ///< pyramid level, 0 = full size
};

/// What the feature stage gives for one frame: keypoints and descriptors, index by index.
struct Features {
  std::vector<Keypoint> keypoints;
  std::vector<Descriptor> descriptors;

  [[nodiscard]] std::size_t size() const { return keypoints.size(); }
};

}  // namespace ipl_slam
