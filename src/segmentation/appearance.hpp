#pragma once

#include <array>

#include "segmentation/bit_mask.hpp"
#include "segmentation/mask_carrier.hpp"

namespace ipl_slam {

/// What an instance looks like, coarse enough to survive turning round: a histogram of its colours.
class Appearance {
 public:
  Appearance() = default;
  /// Of the pixels of a mask.
  Appearance(const CarryView& view, const BitMask& mask);

  /// Whether there was anything to look at.
  [[nodiscard]] bool known() const { return known_; }
  /// Bhattacharyya coefficient: 1 = alike, 0 = not a colour in common.
  [[nodiscard]] double similarity(const Appearance& other) const;
  /// Becomes (1 - rate) of itself and rate of the other.
  void blend(const Appearance& other, float rate);

 private:
  static constexpr int kBins = 6;  // per channel
  bool known_ = false;
  std::array<float, kBins * kBins * kBins> share_{};  // sums to 1
};

}  // namespace ipl_slam
