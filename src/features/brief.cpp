#include "features/brief.hpp"

#include <cmath>
#include <numbers>

#include "features/orientation.hpp"

#if IPL_SLAM_HAS_AVX2_CODE
#include <immintrin.h>
#endif

namespace ipl_slam {

BriefDescriber::BriefDescriber() : turned_(kAngles) {
  for (int bin = 0; bin < kAngles; ++bin) {
    const double angle = bin * 2.0 * std::numbers::pi / kAngles;
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    for (std::size_t i = 0; i < 256; ++i) {
      const BriefTest& t = brief_pattern()[i];
      Group& group = turned_[static_cast<std::size_t>(bin)][i / 8];
      const std::size_t at = i % 8 * 2;
      group.first[at] = static_cast<std::int8_t>(std::lround(c * t.x1 - s * t.y1));
      group.first[at + 1] = static_cast<std::int8_t>(std::lround(s * t.x1 + c * t.y1));
      group.second[at] = static_cast<std::int8_t>(std::lround(c * t.x2 - s * t.y2));
      group.second[at + 1] = static_cast<std::int8_t>(std::lround(s * t.x2 + c * t.y2));
    }
  }
}

Descriptor BriefDescriber::describe_portable(const Pattern& pattern, const std::uint8_t* center,
                                             std::ptrdiff_t step) {
  Descriptor d{};
  for (std::size_t g = 0; g < pattern.size(); ++g) {
    const Group& group = pattern[g];
    std::uint64_t byte = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      const std::uint8_t a = center[group.first[2 * i + 1] * step + group.first[2 * i]];
      const std::uint8_t b = center[group.second[2 * i + 1] * step + group.second[2 * i]];
      byte |= static_cast<std::uint64_t>(a < b) << i;
    }
    d[g / 8] |= byte << (g % 8 * 8);
  }
  return d;
}

#if IPL_SLAM_HAS_AVX2_CODE

namespace {

// The eight pixels at the given (x, y) offsets, in the low byte of each lane. A gather reads four bytes a
// lane, which stay inside the image because the patch keeps kPatchBorder from its last row.
IPL_SLAM_TARGET_AVX2 inline __m256i pixels_at(const std::array<std::int8_t, 16>& xy,
                                              const std::uint8_t* center, __m256i one_and_step) {
  const __m128i packed = _mm_loadu_si128(reinterpret_cast<const __m128i*>(xy.data()));
  const __m256i offsets = _mm256_madd_epi16(_mm256_cvtepi8_epi16(packed), one_and_step);
  const __m256i words = _mm256_i32gather_epi32(reinterpret_cast<const int*>(center), offsets, 1);
  return _mm256_and_si256(words, _mm256_set1_epi32(0xFF));
}

}  // namespace

IPL_SLAM_TARGET_AVX2 Descriptor BriefDescriber::describe_avx2(const Pattern& pattern,
                                                              const std::uint8_t* center,
                                                              std::ptrdiff_t step) {
  const __m256i one_and_step = _mm256_set1_epi32(static_cast<int>((step << 16) | 1));
  Descriptor d{};
  for (std::size_t g = 0; g < pattern.size(); ++g) {
    const __m256i a = pixels_at(pattern[g].first, center, one_and_step);
    const __m256i b = pixels_at(pattern[g].second, center, one_and_step);
    const auto byte =
        static_cast<std::uint64_t>(_mm256_movemask_ps(_mm256_castsi256_ps(_mm256_sub_epi32(a, b))));
    d[g / 8] |= byte << (g % 8 * 8);
  }
  return d;
}

#endif

Descriptor BriefDescriber::describe(const std::uint8_t* center, std::ptrdiff_t step, float angle,
                                    Simd simd) const {
  constexpr float kPerRadian = static_cast<float>(kAngles) / (2.0F * std::numbers::pi_v<float>);
  const auto bin = static_cast<std::size_t>(std::lround(angle * kPerRadian)) % kAngles;
#if IPL_SLAM_HAS_AVX2_CODE
  if (simd == Simd::avx2 && step <= 32767) return describe_avx2(turned_[bin], center, step);
#endif
  static_cast<void>(simd);
  return describe_portable(turned_[bin], center, step);
}

}  // namespace ipl_slam
