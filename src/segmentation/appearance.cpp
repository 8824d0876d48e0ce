#include "segmentation/appearance.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace ipl_slam {

Appearance::Appearance(const CarryView& view, const BitMask& mask) {
  const cv::Rect box = mask.bounding_box();
  const int channels = view.color.channels();
  const auto bin = [](int value) { return value * kBins / 256; };
  int count = 0;
  for (int y = box.y / 2; y < std::min(box.br().y / 2, view.color.rows); ++y) {
    const auto* row = view.color.ptr<std::uint8_t>(y);
    for (int x = box.x / 2; x < std::min(box.br().x / 2, view.color.cols); ++x) {
      if (!mask.test(2 * x, 2 * y)) continue;
      const std::uint8_t* pixel = row + channels * x;
      const int b = bin(pixel[0]), g = bin(pixel[channels / 2]), r = bin(pixel[channels - 1]);
      share_[static_cast<std::size_t>((b * kBins + g) * kBins + r)] += 1.0F;
      ++count;
    }
  }
  known_ = count > 0;
  if (!known_) return;
  for (float& share : share_) share /= static_cast<float>(count);
}

double Appearance::similarity(const Appearance& other) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < share_.size(); ++i) sum += std::sqrt(share_[i] * other.share_[i]);
  return sum;
}

void Appearance::blend(const Appearance& other, float rate) {
  if (!other.known_) return;
  if (!known_) {
    *this = other;
    return;
  }
  for (std::size_t i = 0; i < share_.size(); ++i) share_[i] += rate * (other.share_[i] - share_[i]);
}

}  // namespace ipl_slam
