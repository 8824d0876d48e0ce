#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "common/cpu.hpp"

namespace ipl_slam {

/// A binary image, one bit per pixel: pixel (x, y) is bit x % 64 of word x / 64 of row y. Bits beyond the
/// width are 0. Two masks that are combined must be of the same size. Functions that take a Simd give the
/// same result with either body.
class BitMask {
 public:
  BitMask() = default;
  /// All pixels off.
  explicit BitMask(cv::Size size);
  /// On where a CV_8UC1 image is not 0.
  [[nodiscard]] static BitMask from_image(const cv::Mat& image, Simd simd = best_simd());
  /// CV_8UC1, 255 where on, 0 elsewhere.
  [[nodiscard]] cv::Mat to_image(Simd simd = best_simd()) const;

  [[nodiscard]] cv::Size size() const { return size_; }
  [[nodiscard]] int words_per_row() const { return words_per_row_; }
  [[nodiscard]] std::uint64_t* row(int y) { return words_.data() + offset(y); }
  [[nodiscard]] const std::uint64_t* row(int y) const { return words_.data() + offset(y); }
  /// All rows, one after the other.
  [[nodiscard]] const std::vector<std::uint64_t>& words() const { return words_; }

  [[nodiscard]] bool test(int x, int y) const { return row(y)[x / 64] >> (x % 64) & 1U; }
  void set(int x, int y) { row(y)[x / 64] |= std::uint64_t{1} << (x % 64); }
  /// Switches on the pixels first <= x < last of row y.
  void set_run(int y, int first, int last);

  /// Number of pixels that are on.
  [[nodiscard]] int area(Simd simd = best_simd()) const;
  [[nodiscard]] bool none() const;
  /// The smallest rectangle that holds every pixel that is on; empty if none is.
  [[nodiscard]] cv::Rect bounding_box() const;

  BitMask& operator|=(const BitMask& other);
  BitMask& operator&=(const BitMask& other);
  /// Switches off what is on in the other.
  BitMask& operator-=(const BitMask& other);
  friend bool operator==(const BitMask& a, const BitMask& b) {
    return a.size_ == b.size_ && a.words_ == b.words_;
  }

 private:
  [[nodiscard]] std::size_t offset(int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(words_per_row_);
  }

  cv::Size size_;
  int words_per_row_ = 0;
  std::vector<std::uint64_t> words_;
};

/// Number of pixels that are on in both.
[[nodiscard]] int intersection_area(const BitMask& a, const BitMask& b, Simd simd = best_simd());
/// |A and B| / |A or B|; 0 if both are empty.
[[nodiscard]] double iou(const BitMask& a, const BitMask& b, Simd simd = best_simd());
/// On where a pixel of the mask lies within `radius` pixels (a disc, centre to centre; >= 0).
[[nodiscard]] BitMask dilated(const BitMask& mask, int radius);

}  // namespace ipl_slam
