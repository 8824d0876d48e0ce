#include "dense/cloud_file.hpp"

#include <cmath>
#include <map>
#include <stdexcept>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "common/byte_stream.hpp"
#include "dense/legend_line.hpp"

namespace ipl_slam {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kMadeBy = "made by ipl_slam: static surfaces, world frame, metres";

// What colour each point is written with.
class Palette {
 public:
  Palette(const SemanticCloud& cloud, CloudColors colors) {
    if (colors != CloudColors::kLabels) return;
    for (const CloudClass& c : cloud.classes) classes_[c.label] = c.color;
  }

  [[nodiscard]] Rgb operator()(const CloudPoint& point) const {
    const auto known = classes_.find(point.label);
    return known == classes_.end() ? point.color : known->second;
  }

 private:
  std::map<std::int32_t, Rgb> classes_;
};

void put(ByteWriter& out, const Eigen::Vector3f& v) {
  out.put(v.x());
  out.put(v.y());
  out.put(v.z());
}

void put(ByteWriter& out, const Rgb& color) {
  for (const std::uint8_t channel : color) out.put(channel);
}

std::string legend(const SemanticCloud& cloud, std::string_view comment) {
  std::string lines;
  for (const CloudClass& c : cloud.classes) lines += fmt::format("{} {}\n", comment, legend_line(c));
  return lines;
}

// Rounded to 0.1 mm: a float's other digits say nothing.
double rounded(float value) {
  return std::round(static_cast<double>(value) * 1e4) / 1e4;
}

Json rounded(const Eigen::Vector3f& v) {
  return {rounded(v.x()), rounded(v.y()), rounded(v.z())};
}

}  // namespace

std::string cloud_ply(const SemanticCloud& cloud, CloudColors colors) {
  ByteWriter out;
  out.put(
      fmt::format("ply\n"
                  "format binary_little_endian 1.0\n"
                  "comment {}\n"
                  "{}"
                  "element vertex {}\n"
                  "property float x\nproperty float y\nproperty float z\n"
                  "property float nx\nproperty float ny\nproperty float nz\n"
                  "property uchar red\nproperty uchar green\nproperty uchar blue\n"
                  "property int label\nproperty float confidence\n"
                  "end_header\n",
                  kMadeBy, legend(cloud, "comment"), cloud.points.size()));
  const Palette color_of(cloud, colors);
  for (const CloudPoint& point : cloud.points) {
    put(out, point.position);
    put(out, point.normal);
    put(out, color_of(point));
    out.put(static_cast<std::uint32_t>(point.label));
    out.put(point.confidence);
  }
  return out.take();
}

std::string cloud_pcd(const SemanticCloud& cloud, CloudColors colors) {
  ByteWriter out;
  out.put(
      fmt::format("# .PCD v0.7 - Point Cloud Data file format\n"
                  "# {0}\n"
                  "{1}"
                  "VERSION 0.7\n"
                  "FIELDS x y z rgb normal_x normal_y normal_z label confidence\n"
                  "SIZE 4 4 4 4 4 4 4 4 4\n"
                  "TYPE F F F F F F F I F\n"
                  "COUNT 1 1 1 1 1 1 1 1 1\n"
                  "WIDTH {2}\n"
                  "HEIGHT 1\n"
                  "VIEWPOINT 0 0 0 1 0 0 0\n"
                  "POINTS {2}\n"
                  "DATA binary\n",
                  kMadeBy, legend(cloud, "#"), cloud.points.size()));
  const Palette color_of(cloud, colors);
  for (const CloudPoint& point : cloud.points) {
    const Rgb color = color_of(point);
    put(out, point.position);
    put(out, Rgb{color[2], color[1], color[0]});
    out.put(std::uint8_t{0});
    put(out, point.normal);
    out.put(static_cast<std::uint32_t>(point.label));
    out.put(point.confidence);
  }
  return out.take();
}

std::string mesh_ply(const TriangleMesh& mesh) {
  if (mesh.colors.size() != mesh.vertices.size()) throw std::invalid_argument("every vertex has a colour");
  ByteWriter out;
  out.put(
      fmt::format("ply\n"
                  "format binary_little_endian 1.0\n"
                  "comment {}\n"
                  "element vertex {}\n"
                  "property float x\nproperty float y\nproperty float z\n"
                  "property uchar red\nproperty uchar green\nproperty uchar blue\n"
                  "element face {}\n"
                  "property list uchar int vertex_indices\n"
                  "end_header\n",
                  kMadeBy, mesh.vertices.size(), mesh.triangles.size()));
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    put(out, mesh.vertices[i]);
    put(out, mesh.colors[i]);
  }
  for (const auto& triangle : mesh.triangles) {
    out.put(std::uint8_t{3});
    for (const std::uint32_t vertex : triangle) out.put(vertex);
  }
  return out.take();
}

Json objects_json(const std::vector<CloudObject>& objects, const std::vector<CloudClass>& classes) {
  Json legend = Json::array(), list = Json::array();
  for (const CloudClass& c : classes) {
    legend.push_back({{"label", c.label}, {"class", c.name}, {"color", c.color}});
  }
  for (const CloudObject& object : objects) {
    list.push_back({{"label", object.label},
                    {"class", object.class_name},
                    {"confidence", rounded(object.confidence)},
                    {"centre", rounded(object.centre)},
                    {"low", rounded(object.low)},
                    {"high", rounded(object.high)},
                    {"views", object.views},
                    {"points", object.points}});
  }
  return {{"legend", legend}, {"objects", list}};
}

}  // namespace ipl_slam
