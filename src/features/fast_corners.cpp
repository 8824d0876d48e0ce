#include "features/fast_corners.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <stdexcept>

#if IPL_SLAM_HAS_AVX2_CODE
#include <immintrin.h>
#endif

namespace ipl_slam {
namespace {

using Circle = std::array<std::ptrdiff_t, 16>;

// Offsets of the 16 pixels of the circle, in order around it; k and k + 8 lie opposite.
Circle circle_offsets(std::ptrdiff_t step) {
  constexpr int kX[16] = {0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1};
  constexpr int kY[16] = {3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1, 0, 1, 2, 3};
  Circle offsets{};
  for (std::size_t k = 0; k < 16; ++k) offsets[k] = kY[k] * step + kX[k];
  return offsets;
}

// The arc of nine that begins at an even k and the one that begins at k + 1 share the eight pixels k + 1 ...
// k + 8: the better of the two is min(shared, max(p[k], p[k + 9])), which halves the work.
int pixel_score(const std::uint8_t* p, const Circle& circle) {
  int ring[16];
  for (std::size_t k = 0; k < 16; ++k) ring[k] = p[circle[k]];
  int brightest = 0;
  int darkest = 255;
  for (int k = 0; k < 16; k += 2) {
    int low = ring[k + 1];
    int high = ring[k + 1];
    for (int j = 2; j <= 8; ++j) {
      low = std::min(low, ring[(k + j) & 15]);
      high = std::max(high, ring[(k + j) & 15]);
    }
    const int a = ring[k];
    const int b = ring[(k + 9) & 15];
    brightest = std::max(brightest, std::min(low, std::max(a, b)));
    darkest = std::min(darkest, std::max(high, std::min(a, b)));
  }
  return std::max({0, brightest - *p, *p - darkest});
}

// Nine contiguous pixels hold at least one of every opposite pair, so two pairs rule most pixels out.
bool may_be_corner(const std::uint8_t* p, const Circle& circle, int threshold) {
  const int a = p[circle[0]], b = p[circle[8]], c = p[circle[4]], d = p[circle[12]];
  return std::min(std::max(a, b), std::max(c, d)) > *p + threshold ||
         std::max(std::min(a, b), std::min(c, d)) < *p - threshold;
}

void score_row_portable(const std::uint8_t* row, const Circle& circle, int begin, int end, int threshold,
                        std::uint8_t* out) {
  for (int x = begin; x < end; ++x) {
    int s = 0;
    if (may_be_corner(row + x, circle, threshold)) s = pixel_score(row + x, circle);
    out[x] = static_cast<std::uint8_t>(s > threshold ? s : 0);
  }
}

void maxima_row_portable(const cv::Mat& score, int y, int begin, int end, std::vector<Corner>& corners) {
  const std::uint8_t* up = score.ptr(y - 1);
  const std::uint8_t* row = score.ptr(y);
  const std::uint8_t* down = score.ptr(y + 1);
  for (int x = begin; x < end; ++x) {
    const std::uint8_t s = row[x];
    if (s == 0) continue;
    const std::uint8_t before = std::max({up[x - 1], up[x], up[x + 1], row[x - 1]});
    const std::uint8_t after = std::max({down[x - 1], down[x], down[x + 1], row[x + 1]});
    if (s > before && s >= after) {
      corners.push_back({static_cast<std::int16_t>(x), static_cast<std::int16_t>(y), s});
    }
  }
}

#if IPL_SLAM_HAS_AVX2_CODE

constexpr int kBlock = 32;  // pixels per AVX2 register

IPL_SLAM_TARGET_AVX2 inline __m256i load32(const std::uint8_t* p) {
  return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p));
}

IPL_SLAM_TARGET_AVX2 inline void store32(std::uint8_t* p, __m256i v) {
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(p), v);
}

IPL_SLAM_TARGET_AVX2 inline __m256i min8(__m256i a, __m256i b) {
  return _mm256_min_epu8(a, b);
}
IPL_SLAM_TARGET_AVX2 inline __m256i max8(__m256i a, __m256i b) {
  return _mm256_max_epu8(a, b);
}

// Scores of 32 neighbouring pixels; the same arithmetic as pixel_score.
IPL_SLAM_TARGET_AVX2 inline void score_block_avx2(const std::uint8_t* p, const Circle& circle,
                                                  __m256i threshold, std::uint8_t* out) {
  const __m256i center = load32(p);
  __m256i ring[16];
  ring[0] = load32(p + circle[0]);
  ring[4] = load32(p + circle[4]);
  ring[8] = load32(p + circle[8]);
  ring[12] = load32(p + circle[12]);
  const __m256i bright = min8(max8(ring[0], ring[8]), max8(ring[4], ring[12]));
  const __m256i dark = max8(min8(ring[0], ring[8]), min8(ring[4], ring[12]));
  const __m256i difference = max8(_mm256_subs_epu8(bright, center), _mm256_subs_epu8(center, dark));
  const __m256i above = _mm256_subs_epu8(difference, threshold);
  if (_mm256_testz_si256(above, above)) {
    store32(out, _mm256_setzero_si256());
    return;
  }
  for (int k = 0; k < 16; ++k) {
    if (k % 4 != 0) ring[k] = load32(p + circle[static_cast<std::size_t>(k)]);
  }
  __m256i low[8], high[8];  // of 2, then 4, then 8 pixels from 2 i + 1 on
  for (int i = 0; i < 8; ++i) {
    low[i] = min8(ring[2 * i + 1], ring[(2 * i + 2) & 15]);
    high[i] = max8(ring[2 * i + 1], ring[(2 * i + 2) & 15]);
  }
  __m256i low4[8], high4[8];
  for (int i = 0; i < 8; ++i) {
    low4[i] = min8(low[i], low[(i + 1) & 7]);
    high4[i] = max8(high[i], high[(i + 1) & 7]);
  }
  __m256i brightest = _mm256_setzero_si256();
  __m256i darkest = _mm256_set1_epi8(-1);
  for (int i = 0; i < 8; ++i) {
    const __m256i a = ring[2 * i];
    const __m256i b = ring[(2 * i + 9) & 15];
    brightest = max8(brightest, min8(min8(low4[i], low4[(i + 2) & 7]), max8(a, b)));
    darkest = min8(darkest, max8(max8(high4[i], high4[(i + 2) & 7]), min8(a, b)));
  }
  const __m256i s = max8(_mm256_subs_epu8(brightest, center), _mm256_subs_epu8(center, darkest));
  const __m256i kept = _mm256_subs_epu8(s, threshold);
  store32(out, _mm256_andnot_si256(_mm256_cmpeq_epi8(kept, _mm256_setzero_si256()), s));
}

IPL_SLAM_TARGET_AVX2 void score_row_avx2(const std::uint8_t* row, const Circle& circle, int begin, int end,
                                         int threshold, std::uint8_t* out) {
  const __m256i t = _mm256_set1_epi8(static_cast<char>(threshold));
  int x = begin;
  for (; x + kBlock <= end; x += kBlock) score_block_avx2(row + x, circle, t, out + x);
  // The last block overlaps the one before it: it writes the same values again.
  if (x < end) score_block_avx2(row + end - kBlock, circle, t, out + end - kBlock);
}

IPL_SLAM_TARGET_AVX2 void maxima_row_avx2(const cv::Mat& score, int y, int begin, int end,
                                          std::vector<Corner>& corners) {
  const std::uint8_t* up = score.ptr(y - 1);
  const std::uint8_t* row = score.ptr(y);
  const std::uint8_t* down = score.ptr(y + 1);
  int x = begin;
  for (; x + kBlock <= end; x += kBlock) {
    const __m256i s = load32(row + x);
    if (_mm256_testz_si256(s, s)) continue;
    const __m256i before =
        max8(max8(load32(up + x - 1), load32(up + x)), max8(load32(up + x + 1), load32(row + x - 1)));
    const __m256i after =
        max8(max8(load32(down + x - 1), load32(down + x)), max8(load32(down + x + 1), load32(row + x + 1)));
    const __m256i not_greater = _mm256_cmpeq_epi8(max8(before, s), before);
    const __m256i at_least = _mm256_cmpeq_epi8(max8(after, s), s);
    auto mask = static_cast<std::uint32_t>(_mm256_movemask_epi8(_mm256_andnot_si256(not_greater, at_least)));
    for (; mask != 0; mask &= mask - 1) {
      const int at = x + std::countr_zero(mask);
      corners.push_back({static_cast<std::int16_t>(at), static_cast<std::int16_t>(y), row[at]});
    }
  }
  maxima_row_portable(score, y, x, end, corners);
}

#endif

bool inside(const cv::Rect& area, const cv::Mat& image, int border) {
  return area.x >= border && area.y >= border && area.x + area.width <= image.cols - border &&
         area.y + area.height <= image.rows - border;
}

}  // namespace

void fast_score(const cv::Mat& image, const cv::Rect& area, int threshold, cv::Mat& score, Simd simd) {
  if (image.type() != CV_8UC1 || score.type() != CV_8UC1 || image.size() != score.size()) {
    throw std::invalid_argument("fast_score: image and score must be 8-bit, one channel, and of one size");
  }
  if (threshold < 0 || threshold > 254 || (!area.empty() && !inside(area, image, kFastRadius))) {
    throw std::invalid_argument("fast_score: area too near the image border or threshold outside 0..254");
  }
  const Circle circle = circle_offsets(static_cast<std::ptrdiff_t>(image.step));
  const int end = area.x + area.width;
  for (int y = area.y; y < area.y + area.height; ++y) {
#if IPL_SLAM_HAS_AVX2_CODE
    if (simd == Simd::avx2 && area.width >= kBlock) {
      score_row_avx2(image.ptr(y), circle, area.x, end, threshold, score.ptr(y));
      continue;
    }
#endif
    score_row_portable(image.ptr(y), circle, area.x, end, threshold, score.ptr(y));
  }
  static_cast<void>(simd);
}

void find_score_maxima(const cv::Mat& score, const cv::Rect& area, std::vector<Corner>& corners, Simd simd) {
  if (score.type() != CV_8UC1 || (!area.empty() && !inside(area, score, 1))) {
    throw std::invalid_argument(
        "find_score_maxima: score must be 8-bit and area one pixel inside its border");
  }
  const int end = area.x + area.width;
  for (int y = area.y; y < area.y + area.height; ++y) {
#if IPL_SLAM_HAS_AVX2_CODE
    if (simd == Simd::avx2) {
      maxima_row_avx2(score, y, area.x, end, corners);
      continue;
    }
#endif
    maxima_row_portable(score, y, area.x, end, corners);
  }
  static_cast<void>(simd);
}

}  // namespace ipl_slam
