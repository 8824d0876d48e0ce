#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "dense/semantic_cloud.hpp"

// What PLY and PCD files have in common: a head that names columns of numbers, then the numbers.
namespace ipl_slam {

enum class NumberType { kI8, kU8, kI16, kU16, kI32, kU32, kI64, kU64, kF32, kF64 };

/// Bytes.
[[nodiscard]] std::size_t size_of(NumberType type);

/// A column: per row `count` numbers or, where `length` is there, as many as a number of that type says that
/// stands before them.
struct PointProperty {
  std::string name;
  NumberType type;
  std::optional<NumberType> length;
  std::uint64_t count = 1;
};

/// Rows of the same columns.
struct PointElement {
  std::string name;
  std::uint64_t rows = 0;
  std::vector<PointProperty> properties;
};

enum class NumberEncoding { kText, kLittleEndian, kBigEndian };

struct PointFileHead {
  NumberEncoding encoding = NumberEncoding::kText;
  std::vector<PointElement> elements;  ///< in the order of their rows; the points are called "vertex"
  std::vector<CloudClass> legend;      ///< from the comments, see legend_line()
  std::size_t size = 0;                ///< bytes of the head
};

/// PLY: Turk, "The PLY polygon file format", 1994; with the names of types that came later (int8, float32,
/// ...). Throws FormatError.
[[nodiscard]] PointFileHead read_ply_head(std::string_view bytes);

/// PCD: "The PCD (Point Cloud Data) file format", documentation of PCL, up to version 0.7. Throws
/// FormatError.
[[nodiscard]] PointFileHead read_pcd_head(std::string_view bytes);

/// Takes numbers one by one, as text between blanks or as bytes. The bytes must outlive it. Throws
/// FormatError behind their end and for text that is no number.
class NumberReader {
 public:
  NumberReader(std::string_view bytes, NumberEncoding encoding) : bytes_(bytes), encoding_(encoding) {}

  [[nodiscard]] double get(NumberType type);
  void skip(NumberType type, std::uint64_t count);
  /// Skips all of a property in one row.
  void skip(const PointProperty& property);
  [[nodiscard]] std::size_t remaining() const { return bytes_.size(); }

 private:
  [[nodiscard]] std::string_view word();

  std::string_view bytes_;  // what is left
  NumberEncoding encoding_;
};

}  // namespace ipl_slam
