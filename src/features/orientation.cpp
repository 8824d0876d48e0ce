#include "features/orientation.hpp"

#include <array>
#include <cmath>
#include <numbers>

#if IPL_SLAM_HAS_AVX2_CODE
#include <immintrin.h>
#endif

namespace ipl_slam {
namespace {

constexpr int kRows = 2 * kPatchRadius + 1;
constexpr int kColumns = 32;  // 31 and one of weight 0

// Weights x and y of every pixel of the disc, 0 outside it.
struct MomentWeights {
  alignas(32) std::array<std::array<std::int8_t, kColumns>, kRows> x{};
  alignas(32) std::array<std::array<std::int8_t, kColumns>, kRows> y{};
};

constexpr MomentWeights make_weights() {
  MomentWeights w;
  // (r + 1/2)^2 rather than r^2: the rounder of the two digital discs.
  constexpr int kLimit = kPatchRadius * (kPatchRadius + 1);
  for (int v = -kPatchRadius; v <= kPatchRadius; ++v) {
    for (int u = -kPatchRadius; u <= kPatchRadius; ++u) {
      if (u * u + v * v > kLimit) continue;
      const auto row = static_cast<std::size_t>(v + kPatchRadius);
      const auto column = static_cast<std::size_t>(u + kPatchRadius);
      w.x[row][column] = static_cast<std::int8_t>(u);
      w.y[row][column] = static_cast<std::int8_t>(v);
    }
  }
  return w;
}

constexpr MomentWeights kWeights = make_weights();

struct Moments {
  int x = 0, y = 0;
};

Moments moments_portable(const std::uint8_t* center, std::ptrdiff_t step) {
  Moments m;
  for (std::size_t row = 0; row < kRows; ++row) {
    const std::uint8_t* p = center + (static_cast<std::ptrdiff_t>(row) - kPatchRadius) * step - kPatchRadius;
    for (std::size_t i = 0; i < kColumns; ++i) {
      m.x += p[i] * kWeights.x[row][i];
      m.y += p[i] * kWeights.y[row][i];
    }
  }
  return m;
}

#if IPL_SLAM_HAS_AVX2_CODE

IPL_SLAM_TARGET_AVX2 int horizontal_sum(__m256i v) {
  __m128i s = _mm_add_epi32(_mm256_castsi256_si128(v), _mm256_extracti128_si256(v, 1));
  s = _mm_add_epi32(s, _mm_shuffle_epi32(s, 0x4E));
  s = _mm_add_epi32(s, _mm_shuffle_epi32(s, 0xB1));
  return _mm_cvtsi128_si32(s);
}

IPL_SLAM_TARGET_AVX2 Moments moments_avx2(const std::uint8_t* center, std::ptrdiff_t step) {
  const __m256i ones = _mm256_set1_epi16(1);
  __m256i sum_x = _mm256_setzero_si256();
  __m256i sum_y = _mm256_setzero_si256();
  const std::uint8_t* p = center - kPatchRadius * step - kPatchRadius;
  for (std::size_t row = 0; row < kRows; ++row, p += step) {
    const __m256i pixels = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p));
    const __m256i wx = _mm256_load_si256(reinterpret_cast<const __m256i*>(kWeights.x[row].data()));
    const __m256i wy = _mm256_load_si256(reinterpret_cast<const __m256i*>(kWeights.y[row].data()));
    // Pairs: at most 2 x 255 x 15, which fits 16 bits; four of them do not always, so widen at once.
    sum_x = _mm256_add_epi32(sum_x, _mm256_madd_epi16(_mm256_maddubs_epi16(pixels, wx), ones));
    sum_y = _mm256_add_epi32(sum_y, _mm256_madd_epi16(_mm256_maddubs_epi16(pixels, wy), ones));
  }
  return {horizontal_sum(sum_x), horizontal_sum(sum_y)};
}

#endif

}  // namespace

float patch_orientation(const std::uint8_t* center, std::ptrdiff_t step, Simd simd) {
#if IPL_SLAM_HAS_AVX2_CODE
  const Moments m = simd == Simd::avx2 ? moments_avx2(center, step) : moments_portable(center, step);
#else
  static_cast<void>(simd);
  const Moments m = moments_portable(center, step);
#endif
  constexpr float kTurn = 2.0F * std::numbers::pi_v<float>;
  const float angle = std::atan2(static_cast<float>(m.y), static_cast<float>(m.x));
  // A tiny negative angle plus a turn may round to the turn itself.
  return angle < 0.0F ? (angle + kTurn < kTurn ? angle + kTurn : 0.0F) : angle;
}

}  // namespace ipl_slam
