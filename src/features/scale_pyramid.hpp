#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace ipl_slam {

/// The image pyramid as the later stages see it: how much a level is scaled down and what that does to the
/// noise.
class ScalePyramid {
 public:
  /// `levels` images, each `factor` times smaller than the one before.
  ScalePyramid(int levels, double factor) : factor_(factor) {
    for (int level = 0; level < levels; ++level) scale_.push_back(std::pow(factor, level));
  }

  [[nodiscard]] int levels() const { return static_cast<int>(scale_.size()); }
  [[nodiscard]] double factor() const { return factor_; }
  /// Size of a pixel of this level in full-size pixels.
  [[nodiscard]] double scale(int level) const { return scale_[level]; }
  /// Variance of a keypoint's position in full-size pixels^2, with one pixel of noise on its own level.
  [[nodiscard]] double sigma2(int level) const { return scale_[level] * scale_[level]; }
  /// Level on which a patch shows at the same size as at distance `max_distance` on level 0, seen from
  /// `distance`.
  [[nodiscard]] int predict_level(double max_distance, double distance) const {
    const int level = static_cast<int>(std::ceil(std::log(max_distance / distance) / std::log(factor_)));
    return std::clamp(level, 0, levels() - 1);
  }

 private:
  double factor_;
  std::vector<double> scale_;
};

}  // namespace ipl_slam
