#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace ipl_slam::synthetic {

/// BGR, 0..255, and an unused fourth value that fills the vector register.
using Color = Eigen::Array4f;

/// A picture that repeats in both directions, kept as a pyramid of halved copies, so that it can be looked up
/// at the sharpness a pixel can carry: detail finer than the pixel's footprint is averaged away, not aliased
/// into corners that jump from frame to frame (Williams, "Pyramidal parametrics", SIGGRAPH 1983).
class Texture {
 public:
  /// image: CV_8UC3, BGR; both sides powers of two.
  explicit Texture(const cv::Mat& image);

  /// Colour around (x, y), in texels of the full image, averaged over about `footprint` texels.
  [[nodiscard]] Color sample(float x, float y, float footprint) const;

  [[nodiscard]] int width() const { return levels_.front().width; }
  [[nodiscard]] int height() const { return levels_.front().height; }

 private:
  struct Level {
    int width, height;
    std::vector<std::uint32_t> texels;  ///< BGR and an unused byte
  };
  [[nodiscard]] static Color bilinear(const Level& level, float x, float y);

  std::vector<Level> levels_;
};

}  // namespace ipl_slam::synthetic
