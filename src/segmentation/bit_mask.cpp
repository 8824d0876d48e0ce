#include "segmentation/bit_mask.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#if IPL_SLAM_HAS_AVX2_CODE
#include <immintrin.h>
#endif

namespace ipl_slam {
namespace {

static_assert(std::endian::native == std::endian::little, "bytes of a word are taken as pixels in order");

// The bits of `count` <= 64 pixels.
std::uint64_t pack_word(const std::uint8_t* pixels, int count) {
  std::uint64_t word = 0;
  int x = 0;
  for (; x + 8 <= count; x += 8) {
    constexpr std::uint64_t kLow7 = 0x7F7F7F7F7F7F7F7F;
    std::uint64_t bytes = 0;
    std::memcpy(&bytes, pixels + x, 8);
    const std::uint64_t on = (((bytes & kLow7) + kLow7) | bytes) >> 7 & 0x0101010101010101;  // 1 per byte
    word |= (on * 0x0102040810204080 >> 56) << x;  // the product gathers bit 8 k in bit 56 + k
  }
  for (; x < count; ++x) word |= static_cast<std::uint64_t>(pixels[x] != 0) << x;
  return word;
}

// For each byte the eight pixels it stands for.
constexpr std::array<std::uint64_t, 256> kPixelsOfByte = [] {
  std::array<std::uint64_t, 256> table{};
  for (std::size_t byte = 0; byte < 256; ++byte) {
    for (std::size_t bit = 0; bit < 8; ++bit) {
      if (byte >> bit & 1U) table[byte] |= std::uint64_t{0xFF} << (8 * bit);
    }
  }
  return table;
}();

void unpack_word(std::uint64_t word, std::uint8_t* pixels, int count) {
  int x = 0;
  for (; x + 8 <= count; x += 8) std::memcpy(pixels + x, &kPixelsOfByte[word >> x & 0xFF], 8);
  for (; x < count; ++x) pixels[x] = word >> x & 1U ? 255 : 0;
}

int count_both(const std::uint64_t* a, const std::uint64_t* b, std::size_t words) {
  int count = 0;
  for (std::size_t i = 0; i < words; ++i) count += std::popcount(a[i] & b[i]);
  return count;
}

#if IPL_SLAM_HAS_AVX2_CODE

// Packs the whole words of a row; returns how many those are.
IPL_SLAM_TARGET_AVX2 int pack_avx2(const std::uint8_t* pixels, int count, std::uint64_t* words) {
  const __m256i zero = _mm256_setzero_si256();
  for (int i = 0; i < count / 64; ++i) {
    const auto* at = reinterpret_cast<const __m256i*>(pixels + 64 * i);
    const auto off_low =
        static_cast<std::uint32_t>(_mm256_movemask_epi8(_mm256_cmpeq_epi8(_mm256_loadu_si256(at), zero)));
    const auto off_high =
        static_cast<std::uint32_t>(_mm256_movemask_epi8(_mm256_cmpeq_epi8(_mm256_loadu_si256(at + 1), zero)));
    words[i] = ~(static_cast<std::uint64_t>(off_high) << 32 | off_low);
  }
  return count / 64;
}

IPL_SLAM_TARGET_AVX2 int unpack_avx2(const std::uint64_t* words, int count, std::uint8_t* pixels) {
  const __m256i spread = _mm256_setr_epi8(0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1,  //
                                          2, 2, 2, 2, 2, 2, 2, 2, 3, 3, 3, 3, 3, 3, 3, 3);
  const __m256i bit_of_byte = _mm256_set1_epi64x(static_cast<std::int64_t>(0x8040201008040201));
  for (int i = 0; i < count / 64; ++i) {
    for (int half = 0; half < 2; ++half) {
      const __m256i bits = _mm256_set1_epi32(static_cast<int>(words[i] >> (32 * half)));
      const __m256i own = _mm256_and_si256(_mm256_shuffle_epi8(bits, spread), bit_of_byte);
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(pixels + 64 * i + 32 * half),
                          _mm256_cmpeq_epi8(own, bit_of_byte));
    }
  }
  return count / 64;
}

// Bits are counted per nibble by table look-up (Mula, Kurz and Lemire, "Faster population counts using AVX2
// instructions", 2018).
IPL_SLAM_TARGET_AVX2 int count_both_avx2(const std::uint64_t* a, const std::uint64_t* b, std::size_t words) {
  const __m256i table = _mm256_setr_epi8(0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4, 0, 1, 1, 2, 1, 2, 2,
                                         3, 1, 2, 2, 3, 2, 3, 3, 4);
  const __m256i nibble = _mm256_set1_epi8(0x0F);
  __m256i sum = _mm256_setzero_si256();
  const std::size_t whole = words / 4 * 4;
  for (std::size_t i = 0; i < whole; i += 4) {
    const __m256i x = _mm256_and_si256(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(a + i)),
                                       _mm256_loadu_si256(reinterpret_cast<const __m256i*>(b + i)));
    const __m256i low = _mm256_shuffle_epi8(table, _mm256_and_si256(x, nibble));
    const __m256i high = _mm256_shuffle_epi8(table, _mm256_and_si256(_mm256_srli_epi16(x, 4), nibble));
    sum = _mm256_add_epi64(sum, _mm256_sad_epu8(_mm256_add_epi8(low, high), _mm256_setzero_si256()));
  }
  alignas(32) std::int64_t lanes[4];
  _mm256_store_si256(reinterpret_cast<__m256i*>(lanes), sum);
  return static_cast<int>(lanes[0] + lanes[1] + lanes[2] + lanes[3]) +
         count_both(a + whole, b + whole, words - whole);
}

#endif

int count_both(const std::vector<std::uint64_t>& a, const std::vector<std::uint64_t>& b, Simd simd) {
#if IPL_SLAM_HAS_AVX2_CODE
  if (simd == Simd::avx2) return count_both_avx2(a.data(), b.data(), a.size());
#endif
  static_cast<void>(simd);
  return count_both(a.data(), b.data(), a.size());
}

// Lets every bit of a row spread to both neighbours.
void widen_row(std::vector<std::uint64_t>& row) {
  std::uint64_t before = 0;  // the previous word as it was
  for (std::size_t i = 0; i < row.size(); ++i) {
    const std::uint64_t word = row[i];
    const std::uint64_t after = i + 1 < row.size() ? row[i + 1] : 0;
    row[i] = word | word << 1 | word >> 1 | before >> 63 | after << 63;
    before = word;
  }
}

}  // namespace

BitMask::BitMask(cv::Size size)
    : size_(size),
      words_per_row_((size.width + 63) / 64),
      words_(static_cast<std::size_t>(words_per_row_) * static_cast<std::size_t>(size.height)) {}

BitMask BitMask::from_image(const cv::Mat& image, Simd simd) {
  CV_Assert(image.type() == CV_8UC1);
  BitMask mask(image.size());
  for (int y = 0; y < image.rows; ++y) {
    const auto* pixels = image.ptr<std::uint8_t>(y);
    int done = 0;  // words
#if IPL_SLAM_HAS_AVX2_CODE
    if (simd == Simd::avx2) done = pack_avx2(pixels, image.cols, mask.row(y));
#endif
    for (int i = done; i < mask.words_per_row(); ++i) {
      mask.row(y)[i] = pack_word(pixels + 64 * i, std::min(64, image.cols - 64 * i));
    }
  }
  static_cast<void>(simd);
  return mask;
}

cv::Mat BitMask::to_image(Simd simd) const {
  cv::Mat image(size_, CV_8UC1);
  for (int y = 0; y < size_.height; ++y) {
    auto* pixels = image.ptr<std::uint8_t>(y);
    int done = 0;  // words
#if IPL_SLAM_HAS_AVX2_CODE
    if (simd == Simd::avx2) done = unpack_avx2(row(y), size_.width, pixels);
#endif
    for (int i = done; i < words_per_row_; ++i) {
      unpack_word(row(y)[i], pixels + 64 * i, std::min(64, size_.width - 64 * i));
    }
  }
  static_cast<void>(simd);
  return image;
}

void BitMask::set_run(int y, int first, int last) {
  constexpr std::uint64_t kAll = ~std::uint64_t{0};
  for (int i = first / 64; 64 * i < last; ++i) {
    const std::uint64_t from = first > 64 * i ? kAll << (first - 64 * i) : kAll;
    const std::uint64_t to = last < 64 * i + 64 ? ~(kAll << (last - 64 * i)) : kAll;
    row(y)[i] |= from & to;
  }
}

int BitMask::area(Simd simd) const {
  return count_both(words_, words_, simd);
}

bool BitMask::none() const {
  return std::all_of(words_.begin(), words_.end(), [](std::uint64_t word) { return word == 0; });
}

cv::Rect BitMask::bounding_box() const {
  const auto first = std::find_if(words_.begin(), words_.end(), [](std::uint64_t word) { return word != 0; });
  if (first == words_.end()) return {};
  const auto last =
      std::find_if(words_.rbegin(), words_.rend(), [](std::uint64_t word) { return word != 0; });
  const int top = static_cast<int>(first - words_.begin()) / words_per_row_;
  const int bottom = static_cast<int>(words_.rend() - last - 1) / words_per_row_;
  std::vector<std::uint64_t> columns(static_cast<std::size_t>(words_per_row_));  // a row, on where any row is
  for (int y = top; y <= bottom; ++y) {
    for (std::size_t i = 0; i < columns.size(); ++i) columns[i] |= row(y)[i];
  }
  std::size_t left = 0, right = columns.size() - 1;  // words
  while (columns[left] == 0) ++left;
  while (columns[right] == 0) --right;
  const int x_left = 64 * static_cast<int>(left) + std::countr_zero(columns[left]);
  const int x_right = 64 * static_cast<int>(right) + 63 - std::countl_zero(columns[right]);
  return {x_left, top, x_right - x_left + 1, bottom - top + 1};
}

BitMask& BitMask::operator|=(const BitMask& other) {
  CV_Assert(size_ == other.size_);
  for (std::size_t i = 0; i < words_.size(); ++i) words_[i] |= other.words_[i];
  return *this;
}

BitMask& BitMask::operator&=(const BitMask& other) {
  CV_Assert(size_ == other.size_);
  for (std::size_t i = 0; i < words_.size(); ++i) words_[i] &= other.words_[i];
  return *this;
}

BitMask& BitMask::operator-=(const BitMask& other) {
  CV_Assert(size_ == other.size_);
  for (std::size_t i = 0; i < words_.size(); ++i) words_[i] &= ~other.words_[i];
  return *this;
}

int intersection_area(const BitMask& a, const BitMask& b, Simd simd) {
  CV_Assert(a.size() == b.size());
  return count_both(a.words(), b.words(), simd);
}

double iou(const BitMask& a, const BitMask& b, Simd simd) {
  const int both = intersection_area(a, b, simd);
  const int either = a.area(simd) + b.area(simd) - both;
  return either == 0 ? 0.0 : static_cast<double>(both) / either;
}

BitMask dilated(const BitMask& mask, int radius) {
  CV_Assert(radius >= 0);
  BitMask result(mask.size());
  const cv::Rect box = mask.bounding_box();
  if (box.empty()) return result;
  const int height = mask.size().height;
  const auto words = static_cast<std::size_t>(mask.words_per_row());
  const int bits_of_last = mask.size().width - 64 * (mask.words_per_row() - 1);
  const std::uint64_t inside_of_last = ~std::uint64_t{0} >> (64 - bits_of_last);
  std::vector<std::uint64_t> wide(words);
  for (int y = box.y; y < box.y + box.height; ++y) {
    // A disc is a stack of runs that grow from its top and bottom towards its middle: the row is widened step
    // by step and laid over the rows that are dy away.
    std::copy_n(mask.row(y), words, wide.begin());
    int half_width = 0;
    for (int dy = radius; dy >= 0; --dy) {
      for (; (half_width + 1) * (half_width + 1) + dy * dy <= radius * radius; ++half_width) widen_row(wide);
      wide.back() &= inside_of_last;
      for (const int target : {y - dy, y + dy}) {
        if (target < 0 || target >= height) continue;
        std::uint64_t* out = result.row(target);
        for (std::size_t i = 0; i < words; ++i) out[i] |= wide[i];
      }
    }
  }
  return result;
}

}  // namespace ipl_slam
