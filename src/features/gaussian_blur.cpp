#include "features/gaussian_blur.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <vector>

#if IPL_SLAM_HAS_AVX2_CODE
#include <immintrin.h>
#endif

namespace ipl_slam {
namespace {

constexpr int kRadius = 3;
constexpr int kBlock = 32;
// exp(-i^2 / 8) for i = 0..3, scaled to a total of 128 so that sums of products stay within 16 bits.
constexpr int kW0 = 28, kW1 = 24, kW2 = 17, kW3 = 9;
static_assert(kW0 + 2 * (kW1 + kW2 + kW3) == 128);

using Rows = std::array<const std::uint8_t*, 7>;  // rows y - 3 ... y + 3

std::uint8_t weigh(int p0, int p1, int p2, int p3, int p4, int p5, int p6) {
  return static_cast<std::uint8_t>((kW0 * p3 + kW1 * (p2 + p4) + kW2 * (p1 + p5) + kW3 * (p0 + p6) + 64) >>
                                   7);
}

void vertical_portable(const Rows& r, int begin, int end, std::uint8_t* out) {
  for (int x = begin; x < end; ++x) {
    out[x] = weigh(r[0][x], r[1][x], r[2][x], r[3][x], r[4][x], r[5][x], r[6][x]);
  }
}

void horizontal_portable(const std::uint8_t* in, int begin, int end, std::uint8_t* out) {
  for (int x = begin; x < end; ++x) {
    out[x] = weigh(in[x - 3], in[x - 2], in[x - 1], in[x], in[x + 1], in[x + 2], in[x + 3]);
  }
}

#if IPL_SLAM_HAS_AVX2_CODE

IPL_SLAM_TARGET_AVX2 inline __m256i load32(const std::uint8_t* p) {
  return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p));
}

IPL_SLAM_TARGET_AVX2 inline __m256i weight_pair(int a, int b) {
  return _mm256_set1_epi16(static_cast<std::int16_t>(a | (b << 8)));
}

// Pixels are interleaved in pairs, so that one multiply-add handles two taps; unpack and pack undo each
// other.
IPL_SLAM_TARGET_AVX2 inline __m256i weigh_avx2(__m256i p0, __m256i p1, __m256i p2, __m256i p3, __m256i p4,
                                               __m256i p5, __m256i p6) {
  const __m256i w01 = weight_pair(kW3, kW2);
  const __m256i w23 = weight_pair(kW1, kW0);
  const __m256i w45 = weight_pair(kW1, kW2);
  const __m256i w6r = weight_pair(kW3, 64);  // the last pair carries the rounding term
  const __m256i one = _mm256_set1_epi8(1);
  const __m256i low =
      _mm256_add_epi16(_mm256_add_epi16(_mm256_maddubs_epi16(_mm256_unpacklo_epi8(p0, p1), w01),
                                        _mm256_maddubs_epi16(_mm256_unpacklo_epi8(p2, p3), w23)),
                       _mm256_add_epi16(_mm256_maddubs_epi16(_mm256_unpacklo_epi8(p4, p5), w45),
                                        _mm256_maddubs_epi16(_mm256_unpacklo_epi8(p6, one), w6r)));
  const __m256i high =
      _mm256_add_epi16(_mm256_add_epi16(_mm256_maddubs_epi16(_mm256_unpackhi_epi8(p0, p1), w01),
                                        _mm256_maddubs_epi16(_mm256_unpackhi_epi8(p2, p3), w23)),
                       _mm256_add_epi16(_mm256_maddubs_epi16(_mm256_unpackhi_epi8(p4, p5), w45),
                                        _mm256_maddubs_epi16(_mm256_unpackhi_epi8(p6, one), w6r)));
  return _mm256_packus_epi16(_mm256_srli_epi16(low, 7), _mm256_srli_epi16(high, 7));
}

IPL_SLAM_TARGET_AVX2 inline void vertical_block(const Rows& r, int x, std::uint8_t* out) {
  const __m256i v = weigh_avx2(load32(r[0] + x), load32(r[1] + x), load32(r[2] + x), load32(r[3] + x),
                               load32(r[4] + x), load32(r[5] + x), load32(r[6] + x));
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(out + x), v);
}

IPL_SLAM_TARGET_AVX2 inline void horizontal_block(const std::uint8_t* in, int x, std::uint8_t* out) {
  const std::uint8_t* p = in + x;
  const __m256i v = weigh_avx2(load32(p - 3), load32(p - 2), load32(p - 1), load32(p), load32(p + 1),
                               load32(p + 2), load32(p + 3));
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(out + x), v);
}

// Rows of at least one block; the last block overlaps the one before it and writes the same values again.
IPL_SLAM_TARGET_AVX2 void vertical_avx2(const Rows& r, int width, std::uint8_t* out) {
  int x = 0;
  for (; x + kBlock <= width; x += kBlock) vertical_block(r, x, out);
  if (x < width) vertical_block(r, width - kBlock, out);
}

IPL_SLAM_TARGET_AVX2 void horizontal_avx2(const std::uint8_t* in, int width, std::uint8_t* out) {
  int x = 0;
  for (; x + kBlock <= width; x += kBlock) horizontal_block(in, x, out);
  if (x < width) horizontal_block(in, width - kBlock, out);
}

#endif

}  // namespace

void gaussian_blur_7x7(const cv::Mat& image, cv::Mat& out, Simd simd) {
  if (image.type() != CV_8UC1 || out.type() != CV_8UC1 || image.size() != out.size() ||
      image.data == out.data) {
    throw std::invalid_argument(
        "gaussian_blur_7x7: two different 8-bit one-channel images of one size are needed");
  }
  const int width = image.cols;
  const auto w = static_cast<std::size_t>(width);
  std::vector<std::uint8_t> buffer(w + 2 * kRadius);
  std::uint8_t* line = buffer.data() + kRadius;
  for (int y = 0; y < image.rows; ++y) {
    Rows rows{};
    for (int k = 0; k < 7; ++k) {
      rows[static_cast<std::size_t>(k)] = image.ptr(std::clamp(y + k - kRadius, 0, image.rows - 1));
    }
    const bool wide = simd == Simd::avx2 && width >= kBlock;
#if IPL_SLAM_HAS_AVX2_CODE
    if (wide) vertical_avx2(rows, width, line);
#endif
    if (!wide) vertical_portable(rows, 0, width, line);
    std::memset(buffer.data(), line[0], kRadius);
    std::memset(line + width, line[width - 1], kRadius);
#if IPL_SLAM_HAS_AVX2_CODE
    if (wide) horizontal_avx2(line, width, out.ptr(y));
#endif
    if (!wide) horizontal_portable(line, 0, width, out.ptr(y));
  }
}

}  // namespace ipl_slam
