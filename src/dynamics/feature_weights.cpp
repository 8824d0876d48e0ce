#include "dynamics/feature_weights.hpp"

#include <cmath>

namespace ipl_slam {

bool covers(const BitMask& mask, const Eigen::Vector2d& pixel) {
  const long x = std::lround(pixel.x()), y = std::lround(pixel.y());
  return x >= 0 && y >= 0 && x < mask.size().width && y < mask.size().height &&
         mask.test(static_cast<int>(x), static_cast<int>(y));
}

double share_inside(const BitMask& mask, const Eigen::Vector2d& start, const Eigen::Vector2d& end) {
  constexpr int kSamples = 16;
  int count = 0;
  for (int i = 0; i < kSamples; ++i)
    count += covers(mask, start + (end - start) * ((i + 0.5) / kSamples)) ? 1 : 0;
  return static_cast<double>(count) / kSamples;
}

std::vector<std::uint8_t> removed_features(const std::vector<double>& weights, std::size_t features) {
  std::vector<std::uint8_t> removed(features, 0);
  for (std::size_t k = 0; k < weights.size(); ++k) removed[k] = weights[k] > 0.0 ? 0 : 1;
  return removed;
}

}  // namespace ipl_slam
