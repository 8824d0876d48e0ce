#include "segmentation/bit_mask.hpp"

#include <algorithm>
#include <bit>

namespace ipl_slam {

BitMask::BitMask(cv::Size size)
    : size_(size),
      words_per_row_((size.width + 63) / 64),
      words_(static_cast<std::size_t>(words_per_row_) * static_cast<std::size_t>(size.height)) {}

BitMask BitMask::from_image(const cv::Mat& image) {
  CV_Assert(image.type() == CV_8UC1);
  BitMask mask(image.size());
  for (int y = 0; y < image.rows; ++y) {
    const auto* pixels = image.ptr<std::uint8_t>(y);
    std::uint64_t* words = mask.row(y);
    for (int x = 0; x < image.cols; ++x) {
      words[x / 64] |= static_cast<std::uint64_t>(pixels[x] != 0) << (x % 64);
    }
  }
  return mask;
}

cv::Mat BitMask::to_image() const {
  cv::Mat image(size_, CV_8UC1);
  for (int y = 0; y < size_.height; ++y) {
    auto* pixels = image.ptr<std::uint8_t>(y);
    for (int x = 0; x < size_.width; ++x) pixels[x] = test(x, y) ? 255 : 0;
  }
  return image;
}

void BitMask::set_run(int y, int first, int last) {
  for (int x = first; x < last; ++x) set(x, y);
}

int BitMask::area() const {
  int area = 0;
  for (const std::uint64_t word : words_) area += std::popcount(word);
  return area;
}

cv::Rect BitMask::bounding_box() const {
  int left = size_.width, right = -1, top = size_.height, bottom = -1;
  for (int y = 0; y < size_.height; ++y) {
    const std::uint64_t* words = row(y);
    for (int i = 0; i < words_per_row_; ++i) {
      if (words[i] == 0) continue;
      left = std::min(left, 64 * i + std::countr_zero(words[i]));
      right = std::max(right, 64 * i + 63 - std::countl_zero(words[i]));
      top = std::min(top, y);
      bottom = y;
    }
  }
  return right < 0 ? cv::Rect() : cv::Rect(left, top, right - left + 1, bottom - top + 1);
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

int intersection_area(const BitMask& a, const BitMask& b) {
  CV_Assert(a.size() == b.size());
  int area = 0;
  for (int y = 0; y < a.size().height; ++y) {
    for (int i = 0; i < a.words_per_row(); ++i) area += std::popcount(a.row(y)[i] & b.row(y)[i]);
  }
  return area;
}

double iou(const BitMask& a, const BitMask& b) {
  const int both = intersection_area(a, b);
  const int either = a.area() + b.area() - both;
  return either == 0 ? 0.0 : static_cast<double>(both) / either;
}

}  // namespace ipl_slam
