#include "features/hamming.hpp"

#include <algorithm>
#include <cstdint>
#include <stdexcept>

#if IPL_SLAM_HAS_AVX2_CODE
#include <immintrin.h>
#endif

namespace ipl_slam {
namespace {

// Distance and index in one number that orders by distance, then index: the two smallest of a set then take
// one minimum and one maximum per element, whatever the order they come in.
constexpr int kIndexBits = 20;
constexpr std::uint32_t kIndexMask = (1U << kIndexBits) - 1U;
constexpr std::uint32_t kNoKey = std::numeric_limits<std::int32_t>::max();

struct Two {
  std::uint32_t best = kNoKey, second = kNoKey;

  void add(std::uint32_t key) {
    second = std::min(second, std::max(best, key));
    best = std::min(best, key);
  }
  [[nodiscard]] Nearest nearest() const {
    Nearest n;
    if (best == kNoKey) return n;
    n.index = static_cast<int>(best & kIndexMask);
    n.distance = static_cast<int>(best >> kIndexBits);
    if (second != kNoKey) n.second_distance = static_cast<int>(second >> kIndexBits);
    return n;
  }
};

std::uint32_t key_of(int distance, std::size_t index) {
  return static_cast<std::uint32_t>(distance) << kIndexBits | static_cast<std::uint32_t>(index);
}

// Compares all of `a` with b[begin...].
void compare_portable(std::span<const Descriptor> a, std::span<const Descriptor> b, std::size_t begin,
                      std::vector<Two>& in_b, std::vector<Two>& in_a) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = begin; j < b.size(); ++j) {
      const int distance = hamming_distance(a[i], b[j]);
      in_b[i].add(key_of(distance, j));
      in_a[j].add(key_of(distance, i));
    }
  }
}

#if IPL_SLAM_HAS_AVX2_CODE

constexpr std::size_t kLanes = 8;  // descriptors of b side by side

IPL_SLAM_TARGET_AVX2 inline __m256i load(const void* p) {
  return _mm256_loadu_si256(static_cast<const __m256i*>(p));
}

// Distances of one descriptor to eight, whose 32-bit words lie side by side: bits are counted per byte by
// table look-up (Mula, Kurz and Lemire, "Faster population counts using AVX2 instructions", 2018), summed
// over the eight words (at most 64 a byte) and only then over the four bytes of each lane.
IPL_SLAM_TARGET_AVX2 inline __m256i distances8(const std::uint32_t* words, const std::uint32_t* lanes) {
  const __m256i table = _mm256_setr_epi8(0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4, 0, 1, 1, 2, 1, 2, 2,
                                         3, 1, 2, 2, 3, 2, 3, 3, 4);
  const __m256i nibble = _mm256_set1_epi8(0x0F);
  __m256i bytes = _mm256_setzero_si256();
  for (std::size_t w = 0; w < 8; ++w) {
    const __m256i x =
        _mm256_xor_si256(_mm256_set1_epi32(static_cast<int>(words[w])), load(lanes + w * kLanes));
    const __m256i low = _mm256_shuffle_epi8(table, _mm256_and_si256(x, nibble));
    const __m256i high = _mm256_shuffle_epi8(table, _mm256_and_si256(_mm256_srli_epi16(x, 4), nibble));
    bytes = _mm256_add_epi8(bytes, _mm256_add_epi8(low, high));
  }
  const __m256i pairs = _mm256_maddubs_epi16(bytes, _mm256_set1_epi8(1));
  return _mm256_madd_epi16(pairs, _mm256_set1_epi16(1));
}

IPL_SLAM_TARGET_AVX2 inline void add_keys(__m256i keys, __m256i& best, __m256i& second) {
  second = _mm256_min_epu32(second, _mm256_max_epu32(best, keys));
  best = _mm256_min_epu32(best, keys);
}

// Compares all of `a` with the whole groups of eight in `b`; returns how many of `b` that are.
IPL_SLAM_TARGET_AVX2 std::size_t compare_avx2(std::span<const Descriptor> a, std::span<const Descriptor> b,
                                              std::vector<Two>& in_b, std::vector<Two>& in_a) {
  const std::size_t groups = b.size() / kLanes;
  std::vector<std::uint32_t> lanes(groups * kLanes * 8);
  for (std::size_t j = 0; j < groups * kLanes; ++j) {
    for (std::size_t w = 0; w < 8; ++w) {
      const auto word = static_cast<std::uint32_t>(b[j][w / 2] >> (w % 2 * 32));
      lanes[(j / kLanes * 8 + w) * kLanes + j % kLanes] = word;
    }
  }
  std::vector<std::uint32_t> best_a(groups * kLanes, kNoKey), second_a(groups * kLanes, kNoKey);
  const __m256i lane_numbers = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::uint32_t words[8];
    for (std::size_t w = 0; w < 8; ++w) words[w] = static_cast<std::uint32_t>(a[i][w / 2] >> (w % 2 * 32));
    __m256i best = _mm256_set1_epi32(static_cast<int>(kNoKey)), second = best;
    const __m256i own_index = _mm256_set1_epi32(static_cast<int>(i));
    for (std::size_t g = 0; g < groups; ++g) {
      const __m256i d = _mm256_slli_epi32(distances8(words, lanes.data() + g * 8 * kLanes), kIndexBits);
      const __m256i index = _mm256_add_epi32(lane_numbers, _mm256_set1_epi32(static_cast<int>(g * kLanes)));
      add_keys(_mm256_or_si256(d, index), best, second);
      auto* column_best = reinterpret_cast<__m256i*>(best_a.data() + g * kLanes);
      auto* column_second = reinterpret_cast<__m256i*>(second_a.data() + g * kLanes);
      __m256i best_of_column = _mm256_loadu_si256(column_best);
      __m256i second_of_column = _mm256_loadu_si256(column_second);
      add_keys(_mm256_or_si256(d, own_index), best_of_column, second_of_column);
      _mm256_storeu_si256(column_best, best_of_column);
      _mm256_storeu_si256(column_second, second_of_column);
    }
    std::uint32_t keys[2 * kLanes];
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(keys), best);
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(keys + kLanes), second);
    for (const std::uint32_t key : keys) in_b[i].add(key);
  }
  for (std::size_t j = 0; j < groups * kLanes; ++j) in_a[j] = {best_a[j], second_a[j]};
  return groups * kLanes;
}

#endif

}  // namespace

TwoNearest two_nearest(std::span<const Descriptor> a, std::span<const Descriptor> b, Simd simd) {
  if (a.size() > kIndexMask || b.size() > kIndexMask) {
    throw std::invalid_argument("two_nearest: more than 2^20 descriptors");
  }
  std::vector<Two> in_b(a.size()), in_a(b.size());
  std::size_t done = 0;
#if IPL_SLAM_HAS_AVX2_CODE
  if (simd == Simd::avx2) done = compare_avx2(a, b, in_b, in_a);
#endif
  static_cast<void>(simd);
  compare_portable(a, b, done, in_b, in_a);
  TwoNearest result;
  result.in_b.reserve(a.size());
  result.in_a.reserve(b.size());
  for (const Two& two : in_b) result.in_b.push_back(two.nearest());
  for (const Two& two : in_a) result.in_a.push_back(two.nearest());
  return result;
}

}  // namespace ipl_slam
