#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

#include "common/byte_stream.hpp"
#include "common/text_file.hpp"
#include "dense/cloud_file.hpp"
#include "dense/point_file.hpp"

namespace ipl_slam {
namespace {

// What a column says of a point.
enum Role {
  kX,
  kY,
  kZ,
  kNormalX,
  kNormalY,
  kNormalZ,
  kRed,
  kGreen,
  kBlue,
  kPacked,
  kLabel,
  kConfidence,
  kRoles
};

// Names that this program, CloudCompare ("scalar_"), MeshLab ("diffuse_"), Open3D and PCL give them.
const std::map<std::string_view, Role>& roles() {
  static const std::map<std::string_view, Role> kNames{{"x", kX},
                                                       {"y", kY},
                                                       {"z", kZ},
                                                       {"nx", kNormalX},
                                                       {"ny", kNormalY},
                                                       {"nz", kNormalZ},
                                                       {"normal_x", kNormalX},
                                                       {"normal_y", kNormalY},
                                                       {"normal_z", kNormalZ},
                                                       {"red", kRed},
                                                       {"green", kGreen},
                                                       {"blue", kBlue},
                                                       {"r", kRed},
                                                       {"g", kGreen},
                                                       {"b", kBlue},
                                                       {"diffuse_red", kRed},
                                                       {"diffuse_green", kGreen},
                                                       {"diffuse_blue", kBlue},
                                                       {"rgb", kPacked},
                                                       {"rgba", kPacked},
                                                       {"label", kLabel},
                                                       {"scalar_label", kLabel},
                                                       {"confidence", kConfidence},
                                                       {"scalar_confidence", kConfidence}};
  return kNames;
}

constexpr Rgb kNoColor{200, 200, 200};

// Which column has which role.
class Columns {
 public:
  explicit Columns(const PointElement& element) {
    place_.fill(-1);
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const PointProperty& property = element.properties[i];
      const auto named = roles().find(property.name);
      const bool is_taken = named != roles().end() && place_[named->second] < 0;
      if (property.length || property.count != 1 || !is_taken) continue;
      place_[named->second] = static_cast<int>(i);
      type_[named->second] = property.type;
    }
    for (const Role role : {kX, kY, kZ}) {
      if (place_[role] < 0) throw FormatError("has points without x, y or z; write it with all three");
    }
  }

  [[nodiscard]] bool has(Role role) const { return place_[role] >= 0; }
  [[nodiscard]] bool has_three(Role first) const {
    return has(first) && has(static_cast<Role>(first + 1)) && has(static_cast<Role>(first + 2));
  }
  [[nodiscard]] double value(const std::vector<double>& row, Role role) const {
    return row[static_cast<std::size_t>(place_[role])];
  }
  [[nodiscard]] Eigen::Vector3f vector(const std::vector<double>& row, Role first) const {
    return {float_of(value(row, first)), float_of(value(row, static_cast<Role>(first + 1))),
            float_of(value(row, static_cast<Role>(first + 2)))};
  }
  [[nodiscard]] NumberType type(Role role) const { return type_[role]; }

 private:
  // What a float cannot hold is no number; the cast alone would be undefined.
  static float float_of(double value) {
    return std::abs(value) <= std::numeric_limits<float>::max() ? static_cast<float>(value)
                                                                : std::numeric_limits<float>::quiet_NaN();
  }

  std::array<int, kRoles> place_;
  std::array<NumberType, kRoles> type_{};
};

// A colour channel as 0 to 255; floating-point ones reach to 1, 16-bit ones to 65535.
std::uint8_t channel(double value, NumberType type) {
  if (type == NumberType::kF32 || type == NumberType::kF64) value *= 255.0;
  if (type == NumberType::kU16) value /= 257.0;
  return std::isfinite(value) ? static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0))) : 0;
}

// PCL's 0xaarrggbb, as a whole number or as the float that has these bits.
Rgb unpacked(double value, NumberType type) {
  constexpr double kMost = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t bits = 0;
  if (type == NumberType::kF32) {
    bits = std::bit_cast<std::uint32_t>(std::abs(value) <= std::numeric_limits<float>::max()
                                            ? static_cast<float>(value)
                                            : std::numeric_limits<float>::quiet_NaN());
  } else if (value < 0.0 && value >= std::numeric_limits<std::int32_t>::min()) {
    bits = static_cast<std::uint32_t>(static_cast<std::int32_t>(value));
  } else if (value >= 0.0 && value <= kMost) {
    bits = static_cast<std::uint32_t>(value);
  }
  return {static_cast<std::uint8_t>(bits >> 16U), static_cast<std::uint8_t>(bits >> 8U),
          static_cast<std::uint8_t>(bits)};
}

// Of unit length, or zero where there is none. What is a unit vector but for rounding stays as it is.
Eigen::Vector3f unit_or_zero(const Eigen::Vector3f& normal) {
  constexpr float kRounding = 1e-3F, kLeast = 1e-6F;
  const float length = normal.stableNorm();
  if (!(length > kLeast && length <= std::numeric_limits<float>::max())) return Eigen::Vector3f::Zero();
  return std::abs(length - 1.0F) < kRounding ? normal : Eigen::Vector3f(normal / length);
}

CloudPoint point_of(const std::vector<double>& row, const Columns& columns) {
  CloudPoint point;
  point.position = columns.vector(row, kX);
  point.color = kNoColor;
  if (columns.has_three(kNormalX)) point.normal = unit_or_zero(columns.vector(row, kNormalX));
  if (columns.has_three(kRed)) {
    for (std::size_t i = 0; i < 3; ++i) {
      const auto role = static_cast<Role>(kRed + i);
      point.color[i] = channel(columns.value(row, role), columns.type(role));
    }
  } else if (columns.has(kPacked)) {
    point.color = unpacked(columns.value(row, kPacked), columns.type(kPacked));
  }
  if (columns.has(kLabel)) {
    const double label = columns.value(row, kLabel);
    const bool is_label = label >= 0.0 && label <= std::numeric_limits<std::int32_t>::max();
    if (is_label) point.label = static_cast<std::int32_t>(label);
  }
  if (columns.has(kConfidence)) {
    const double confidence = columns.value(row, kConfidence);
    if (confidence > 0.0) point.confidence = static_cast<float>(std::min(confidence, 1.0));
  }
  return point;
}

std::vector<CloudPoint> read_points(NumberReader& numbers, const PointElement& element) {
  const Columns columns(element);
  std::vector<CloudPoint> points;
  // Rows are what the file says; memory is for those that can follow.
  points.reserve(std::min<std::uint64_t>(element.rows, numbers.remaining() / element.properties.size()));
  std::vector<double> row(element.properties.size());
  for (std::uint64_t i = 0; i < element.rows; ++i) {
    for (std::size_t k = 0; k < row.size(); ++k) {
      const PointProperty& property = element.properties[k];
      if (property.length || property.count != 1) {
        numbers.skip(property);
      } else {
        row[k] = numbers.get(property.type);
      }
    }
    const CloudPoint point = point_of(row, columns);
    if (point.position.allFinite()) points.push_back(point);
  }
  return points;
}

void skip_rows(NumberReader& numbers, const PointElement& element) {
  const auto has_numbers = [](const PointProperty& p) { return p.length || p.count > 0; };
  // Rows of nothing need not be walked through, however many are announced.
  if (std::none_of(element.properties.begin(), element.properties.end(), has_numbers)) return;
  for (std::uint64_t i = 0; i < element.rows; ++i) {
    for (const PointProperty& property : element.properties) numbers.skip(property);
  }
}

// The classes that occur, named as the legend says.
std::vector<CloudClass> classes_of(const std::vector<CloudPoint>& points,
                                   const std::vector<CloudClass>& legend) {
  std::set<std::int32_t> labels;
  for (const CloudPoint& point : points) {
    if (point.label != CloudPoint::kUnlabelled) labels.insert(point.label);
  }
  std::map<std::int32_t, CloudClass> named;
  for (const CloudClass& c : legend) named.emplace(c.label, c);
  std::vector<CloudClass> classes;
  for (const std::int32_t label : labels) {
    const auto known = named.find(label);
    classes.push_back(known != named.end()
                          ? known->second
                          : CloudClass{label, fmt::format("class {}", label), class_color(label)});
  }
  return classes;
}

// A packed colour that is called a float must not be read as one: half of all colours are NaN then, which a
// processor may change.
void read_packed_colors_as_bits(PointFileHead& head) {
  if (head.encoding == NumberEncoding::kText) return;
  for (PointElement& element : head.elements) {
    for (PointProperty& property : element.properties) {
      const auto role = roles().find(property.name);
      if (role == roles().end() || role->second != kPacked) continue;
      if (property.type == NumberType::kF32) property.type = NumberType::kU32;
    }
  }
}

SemanticCloud parse_cloud(std::string_view bytes) {
  const bool is_pcd = bytes.starts_with("# .PCD") || bytes.starts_with("VERSION");
  if (!is_pcd && !bytes.starts_with("ply")) {
    throw FormatError("is no cloud: it begins neither like a PLY nor like a PCD file; check the path");
  }
  PointFileHead head = is_pcd ? read_pcd_head(bytes) : read_ply_head(bytes);
  read_packed_colors_as_bits(head);
  NumberReader numbers(bytes.substr(head.size), head.encoding);
  for (const PointElement& element : head.elements) {
    if (element.name != "vertex") {
      skip_rows(numbers, element);
      continue;
    }
    SemanticCloud cloud;
    cloud.points = read_points(numbers, element);
    cloud.classes = classes_of(cloud.points, head.legend);
    return cloud;
  }
  throw FormatError("has no element vertex, so no points; check the path");
}

}  // namespace

SemanticCloud read_cloud(const std::filesystem::path& file) {
  const std::string bytes = read_file(file);
  try {
    return parse_cloud(bytes);
  } catch (const FormatError& error) {
    throw UserError(fmt::format("'{}' {}", file.string(), error.what()));
  }
}

}  // namespace ipl_slam
