#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "common/byte_stream.hpp"

namespace ipl_slam {

/// Puts numbers of 4 bits behind one another, the low half of a byte first.
class NibbleWriter {
 public:
  void put(unsigned nibble) {
    word_ |= std::uint64_t{nibble} << shift_;
    shift_ += 4;
    if (shift_ == 64) flush(sizeof(word_));
  }
  /// A number below 2^30 in groups of 3 bits, the low ones first; the fourth bit says that more follow.
  void put_number(std::uint32_t value) {
    for (; value > 7; value >>= 3) put(8 | (value & 7));
    put(value);
  }

  [[nodiscard]] std::string take() {
    flush(static_cast<std::size_t>(shift_ + 7) / 8);
    return std::move(bytes_);
  }

 private:
  void flush(std::size_t bytes) {
    char little_endian[sizeof(word_)];
    for (std::size_t i = 0; i < sizeof(word_); ++i) little_endian[i] = static_cast<char>(word_ >> (8 * i));
    bytes_.append(little_endian, bytes);
    word_ = 0;
    shift_ = 0;
  }

  std::string bytes_;
  std::uint64_t word_ = 0;
  int shift_ = 0;
};

/// Takes apart what a NibbleWriter wrote. The bytes must outlive it. Throws FormatError rather than read
/// behind their end.
class NibbleReader {
 public:
  explicit NibbleReader(std::string_view bytes) : bytes_(bytes), end_(2 * bytes.size()) {}

  [[nodiscard]] unsigned get() {
    if (position_ == end_) throw FormatError("is cut short; make it again");
    const auto byte = static_cast<unsigned char>(bytes_[position_ / 2]);
    return byte >> (4 * (position_++ & 1)) & 15U;
  }
  [[nodiscard]] std::uint32_t get_number() {
    std::uint32_t value = 0;
    for (int shift = 0; shift < 30; shift += 3) {
      const unsigned nibble = get();
      value |= (nibble & 7) << shift;
      if (nibble < 8) return value;
    }
    throw FormatError("holds a number that is too large; make it again");
  }
  /// Throws FormatError unless all was read, up to the last byte's padding.
  void expect_end() const {
    if (position_ + 1 < end_) throw FormatError("goes on behind its end; make it again");
  }

 private:
  std::string_view bytes_;
  std::size_t end_ = 0, position_ = 0;
};

}  // namespace ipl_slam
