#pragma once

#include <cstddef>
#include <cstdint>

#include <opencv2/core.hpp>

namespace ipl_slam {

/// Noise added to a grey image before features are taken from it. In lockstep a result has no spread of its
/// own; runs with a little noise, each under another seed, show how much of it is owed to chance.
class ImageNoise {
 public:
  /// deviation: of the noise, in grey values; 0 = none.
  ImageNoise(double deviation, std::uint64_t seed) : deviation_(deviation), seed_(seed) {}

  /// The image with independent, nearly normal noise at every pixel, rounded, and cut off at 0 and 255. The
  /// noise depends on the seed, the frame's index and the pixel alone. The given image is left as it is; it
  /// comes back itself where there is no noise, and where it is not CV_8UC1.
  [[nodiscard]] cv::Mat add(const cv::Mat& grey, std::size_t frame) const;

 private:
  double deviation_;
  std::uint64_t seed_;
};

}  // namespace ipl_slam
