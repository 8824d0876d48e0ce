#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

namespace ipl_slam {

/// Bytes that are not what their format asks for. The message goes on where the name of the file stood:
/// "is cut short: ...", and ends with the mend.
class FormatError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

static_assert(std::numeric_limits<float>::is_iec559 && std::numeric_limits<double>::is_iec559);

/// Puts numbers behind one another, little-endian on every machine, floating-point numbers as in IEEE 754.
class ByteWriter {
 public:
  template <std::unsigned_integral T>
  void put(T value) {
    char bytes[sizeof(T)];
    for (std::size_t i = 0; i < sizeof(T); ++i) bytes[i] = static_cast<char>(value >> (8 * i) & 0xFF);
    bytes_.append(bytes, sizeof(T));
  }
  void put(float value) { put(std::bit_cast<std::uint32_t>(value)); }
  void put(double value) { put(std::bit_cast<std::uint64_t>(value)); }
  void put(std::string_view text) { bytes_.append(text); }

  [[nodiscard]] const std::string& bytes() const { return bytes_; }
  [[nodiscard]] std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

/// Takes apart what a ByteWriter wrote. The bytes must outlive it. Throws FormatError rather than read behind
/// their end.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : bytes_(bytes) {}

  template <std::unsigned_integral T>
  [[nodiscard]] T get() {
    const std::string_view bytes = get_bytes(sizeof(T));
    T value = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      value = static_cast<T>(value |
                             static_cast<T>(static_cast<T>(static_cast<unsigned char>(bytes[i])) << (8 * i)));
    }
    return value;
  }
  template <std::floating_point T>
  [[nodiscard]] T get() {
    using Bits = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
    return std::bit_cast<T>(get<Bits>());
  }
  [[nodiscard]] std::string_view get_bytes(std::size_t size) {
    if (size > remaining()) throw FormatError("more is announced than follows");
    const std::string_view bytes = bytes_.substr(position_, size);
    position_ += size;
    return bytes;
  }

  [[nodiscard]] std::size_t position() const { return position_; }
  [[nodiscard]] std::size_t remaining() const { return bytes_.size() - position_; }

 private:
  std::string_view bytes_;
  std::size_t position_ = 0;
};

}  // namespace ipl_slam
