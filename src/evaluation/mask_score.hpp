#pragma once

#include <cstdint>

#include "segmentation/bit_mask.hpp"

namespace ipl_slam {

/// Pixels of masks compared with the true ones, added up over any number of images.
struct MaskScore {
  std::int64_t hits = 0;          ///< on in both
  std::int64_t misses = 0;        ///< on in the true mask alone
  std::int64_t false_alarms = 0;  ///< on in the found mask alone
  std::int64_t pixels = 0;        ///< of all images

  /// Throws std::invalid_argument where the sizes differ.
  void add(const BitMask& found, const BitMask& truth);
  MaskScore& operator+=(const MaskScore& other);

  /// Share of the true pixels that were found; 1 if there are none.
  [[nodiscard]] double recall() const;
  /// Share of the found pixels that are true; 1 if there are none.
  [[nodiscard]] double precision() const;
  /// Pixels found wrongly, as a share of the images; 0 without an image.
  [[nodiscard]] double false_area() const;
};

}  // namespace ipl_slam
