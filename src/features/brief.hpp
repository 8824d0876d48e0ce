#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/cpu.hpp"
#include "features/features.hpp"

namespace ipl_slam {

/// One binary test: is the first pixel darker than the second? Offsets from the keypoint, inside the patch
/// disc.
struct BriefTest {
  std::int8_t x1, y1, x2, y2;
};

/// The 256 tests of the descriptor at angle 0.
[[nodiscard]] const std::array<BriefTest, 256>& brief_pattern();

/// Steered BRIEF (Rublee et al., ICCV 2011): the tests turned by the keypoint's orientation. Turned patterns
/// are made once for `kAngles` directions; a keypoint takes the nearest.
class BriefDescriber {
 public:
  static constexpr int kAngles = 128;

  BriefDescriber();

  /// Bit i (bit i % 64 of word i / 64) is the outcome of test i around `center`, a pixel of the smoothed
  /// image whose rows are `step` bytes apart and which reaches kPatchBorder further on each side. `angle` in
  /// [0, 2 pi).
  [[nodiscard]] Descriptor describe(const std::uint8_t* center, std::ptrdiff_t step, float angle,
                                    Simd simd = best_simd()) const;

 private:
  // Tests in groups of eight: x, y of the eight first pixels, then x, y of the eight second ones.
  struct Group {
    std::array<std::int8_t, 16> first, second;
  };
  using Pattern = std::array<Group, 32>;

  static Descriptor describe_portable(const Pattern& pattern, const std::uint8_t* center,
                                      std::ptrdiff_t step);
  static Descriptor describe_avx2(const Pattern& pattern, const std::uint8_t* center, std::ptrdiff_t step);

  std::vector<Pattern> turned_;
};

}  // namespace ipl_slam
