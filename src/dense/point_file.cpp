#include "dense/point_file.hpp"

#include <bit>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "common/byte_stream.hpp"
#include "common/text_file.hpp"
#include "dense/legend_line.hpp"

namespace ipl_slam {
namespace {

// The lines of a head, one after the other.
class HeadLines {
 public:
  HeadLines(std::string_view bytes, std::string_view last) : bytes_(bytes), last_(last) {}

  [[nodiscard]] std::string_view next() {
    const std::size_t end = bytes_.find('\n', position_);
    if (end == std::string_view::npos) {
      throw FormatError(fmt::format("is cut short: its head does not end with '{}'; write it again", last_));
    }
    std::string_view line = bytes_.substr(position_, end - position_);
    position_ = end + 1;
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
  }
  [[nodiscard]] std::size_t position() const { return position_; }

 private:
  std::string_view bytes_, last_;
  std::size_t position_ = 0;
};

[[noreturn]] void refuse_line(std::string_view line) {
  throw FormatError(fmt::format("has a head that cannot be understood at '{:.60}'; write it again", line));
}

std::uint64_t count_of(std::string_view word, std::string_view line) {
  // More points than fit into any memory are found out where the file ends.
  constexpr double kMost = 1e15;
  const std::optional<double> value = parse_number(word);
  if (!value || !(*value >= 0.0 && *value <= kMost) || std::floor(*value) != *value) refuse_line(line);
  return static_cast<std::uint64_t>(*value);
}

NumberType ply_type(std::string_view word, std::string_view line) {
  using enum NumberType;
  static const std::map<std::string_view, NumberType> kTypes{
      {"char", kI8},     {"uchar", kU8},   {"short", kI16},  {"ushort", kU16}, {"int", kI32},
      {"uint", kU32},    {"int8", kI8},    {"uint8", kU8},   {"int16", kI16},  {"uint16", kU16},
      {"int32", kI32},   {"uint32", kU32}, {"int64", kI64},  {"uint64", kU64}, {"float", kF32},
      {"float32", kF32}, {"double", kF64}, {"float64", kF64}};
  const auto found = kTypes.find(word);
  if (found == kTypes.end()) refuse_line(line);
  return found->second;
}

PointProperty ply_property(const std::vector<std::string_view>& words, std::string_view line) {
  if (words.size() == 3) return {std::string(words[2]), ply_type(words[1], line), std::nullopt};
  if (words.size() != 5 || words[1] != "list") refuse_line(line);
  const NumberType length = ply_type(words[2], line);
  if (length == NumberType::kF32 || length == NumberType::kF64) refuse_line(line);
  return {std::string(words[4]), ply_type(words[3], line), length};
}

NumberEncoding ply_encoding(const std::vector<std::string_view>& words, std::string_view line) {
  if (words.size() == 3 && words[2] == "1.0") {
    if (words[1] == "ascii") return NumberEncoding::kText;
    if (words[1] == "binary_little_endian") return NumberEncoding::kLittleEndian;
    if (words[1] == "binary_big_endian") return NumberEncoding::kBigEndian;
  }
  refuse_line(line);
}

NumberType pcd_type(std::string_view kind, std::string_view size, std::string_view line) {
  using enum NumberType;
  static const std::map<std::pair<std::string_view, std::string_view>, NumberType> kTypes{
      {{"I", "1"}, kI8},  {{"I", "2"}, kI16}, {{"I", "4"}, kI32}, {{"I", "8"}, kI64}, {{"U", "1"}, kU8},
      {{"U", "2"}, kU16}, {{"U", "4"}, kU32}, {{"U", "8"}, kU64}, {{"F", "4"}, kF32}, {{"F", "8"}, kF64}};
  const auto found = kTypes.find({kind, size});
  if (found == kTypes.end()) refuse_line(line);
  return found->second;
}

// The lines of a PCD head by their first word.
using PcdEntries = std::map<std::string, std::string_view, std::less<>>;

PointElement pcd_points(const PcdEntries& entries) {
  const auto line_of = [&](std::string_view key) -> std::string_view {
    const auto found = entries.find(key);
    if (found == entries.end()) {
      throw FormatError(fmt::format("has a head without a line {}; write it again", key));
    }
    return found->second;
  };
  const auto values = [&](std::string_view key, std::size_t count) {
    const std::vector<std::string_view> words = split_words(line_of(key));
    if (words.size() != count + 1) refuse_line(line_of(key));
    return words;
  };
  PointElement points{"vertex", 0, {}};
  const std::vector<std::string_view> names = split_words(line_of("FIELDS"));
  const std::size_t fields = names.size() - 1;
  const auto sizes = values("SIZE", fields), types = values("TYPE", fields);
  for (std::size_t i = 1; i <= fields; ++i) {
    PointProperty property{std::string(names[i]), pcd_type(types[i], sizes[i], line_of("TYPE")),
                           std::nullopt};
    if (entries.contains("COUNT")) property.count = count_of(values("COUNT", fields)[i], line_of("COUNT"));
    points.properties.push_back(property);
  }
  // Old files have no POINTS; the product of two counts this small cannot overflow.
  const auto number = [&](std::string_view key) {
    const std::uint64_t value = count_of(values(key, 1)[1], line_of(key));
    if (value > 0xFFFFFFFFULL) refuse_line(line_of(key));
    return value;
  };
  points.rows = entries.contains("POINTS") ? number("POINTS") : number("WIDTH") * number("HEIGHT");
  return points;
}

NumberEncoding pcd_encoding(std::string_view line) {
  const std::vector<std::string_view> words = split_words(line);
  if (words.size() == 2 && words[1] == "ascii") return NumberEncoding::kText;
  if (words.size() == 2 && words[1] == "binary") return NumberEncoding::kLittleEndian;
  if (words.size() == 2 && words[1] == "binary_compressed") {
    throw FormatError(
        "is a compressed PCD, which is not read here; pcl_convert_pcd_ascii_binary IN OUT 1 makes a plain "
        "one");
  }
  refuse_line(line);
}

template <class Bits>
double as_number(NumberType type, Bits bits) {
  using Signed = std::make_signed_t<Bits>;
  if constexpr (sizeof(Bits) == 4) {
    if (type == NumberType::kF32) return static_cast<double>(std::bit_cast<float>(bits));
  }
  if constexpr (sizeof(Bits) == 8) {
    if (type == NumberType::kF64) return std::bit_cast<double>(bits);
  }
  const bool is_signed = type == NumberType::kI8 || type == NumberType::kI16 || type == NumberType::kI32 ||
                         type == NumberType::kI64;
  return is_signed ? static_cast<double>(static_cast<Signed>(bits)) : static_cast<double>(bits);
}

template <class Bits>
Bits bits_of(std::string_view bytes, NumberEncoding encoding) {
  Bits value = 0;
  for (std::size_t i = 0; i < sizeof(Bits); ++i) {
    const std::size_t place = encoding == NumberEncoding::kBigEndian ? sizeof(Bits) - 1 - i : i;
    value = static_cast<Bits>(
        value | static_cast<Bits>(static_cast<Bits>(static_cast<unsigned char>(bytes[place])) << (8 * i)));
  }
  return value;
}

[[noreturn]] void refuse_end() {
  throw FormatError("is cut short: more is announced than follows; write it again");
}

}  // namespace

std::size_t size_of(NumberType type) {
  constexpr std::size_t kSizes[] = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

PointFileHead read_ply_head(std::string_view bytes) {
  HeadLines lines(bytes, "end_header");
  if (lines.next() != "ply")
    throw FormatError("is no PLY file: it does not begin with 'ply'; check the path");
  PointFileHead head;
  bool has_format = false;
  while (true) {
    const std::string_view line = lines.next();
    const std::vector<std::string_view> words = split_words(line);
    if (words.empty() || words[0] == "obj_info") continue;
    if (words[0] == "end_header") break;
    if (words[0] == "comment") {
      const std::string_view text = line.substr(line.find("comment") + std::string_view("comment").size());
      if (auto entry = parse_legend_line(text)) head.legend.push_back(std::move(*entry));
    } else if (words[0] == "format") {
      head.encoding = ply_encoding(words, line);
      has_format = true;
    } else if (words[0] == "element" && words.size() == 3) {
      head.elements.push_back({std::string(words[1]), count_of(words[2], line), {}});
    } else if (words[0] == "property" && !head.elements.empty()) {
      head.elements.back().properties.push_back(ply_property(words, line));
    } else {
      refuse_line(line);
    }
  }
  if (!has_format) throw FormatError("has a head without a line format; write it again");
  head.size = lines.position();
  return head;
}

PointFileHead read_pcd_head(std::string_view bytes) {
  HeadLines lines(bytes, "DATA");
  PointFileHead head;
  PcdEntries entries;
  while (true) {
    const std::string_view line = lines.next();
    if (line.starts_with('#')) {
      if (auto entry = parse_legend_line(line.substr(1))) head.legend.push_back(std::move(*entry));
      continue;
    }
    const std::vector<std::string_view> words = split_words(line);
    if (words.empty()) continue;
    if (words[0] == "DATA") {
      head.encoding = pcd_encoding(line);
      break;
    }
    entries.emplace(words[0], line);
  }
  head.elements.push_back(pcd_points(entries));
  head.size = lines.position();
  return head;
}

std::string_view NumberReader::word() {
  constexpr std::string_view kBlanks = " \t\r\n";
  const std::size_t begin = bytes_.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) refuse_end();
  const std::size_t end = std::min(bytes_.find_first_of(kBlanks, begin), bytes_.size());
  const std::string_view result = bytes_.substr(begin, end - begin);
  bytes_.remove_prefix(end);
  return result;
}

double NumberReader::get(NumberType type) {
  if (encoding_ == NumberEncoding::kText) {
    const std::string_view text = word();
    const std::optional<double> value = parse_number(text);
    if (!value) {
      throw FormatError(fmt::format("has '{:.40}' where a number belongs; write it again", text));
    }
    return *value;
  }
  const std::size_t size = size_of(type);
  if (size > bytes_.size()) refuse_end();
  const std::string_view bytes = bytes_.substr(0, size);
  bytes_.remove_prefix(size);
  switch (size) {
    case 1:
      return as_number(type, bits_of<std::uint8_t>(bytes, encoding_));
    case 2:
      return as_number(type, bits_of<std::uint16_t>(bytes, encoding_));
    case 4:
      return as_number(type, bits_of<std::uint32_t>(bytes, encoding_));
    default:
      return as_number(type, bits_of<std::uint64_t>(bytes, encoding_));
  }
}

void NumberReader::skip(NumberType type, std::uint64_t count) {
  if (encoding_ == NumberEncoding::kText) {
    for (std::uint64_t i = 0; i < count; ++i) (void)word();
    return;
  }
  if (count > bytes_.size() / size_of(type)) refuse_end();
  bytes_.remove_prefix(count * size_of(type));
}

void NumberReader::skip(const PointProperty& property) {
  if (!property.length) return skip(property.type, property.count);
  const double length = get(*property.length);
  if (!(length >= 0.0 && length <= static_cast<double>(bytes_.size()))) refuse_end();
  skip(property.type, static_cast<std::uint64_t>(length));
}

}  // namespace ipl_slam
