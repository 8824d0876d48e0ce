#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

// A reader of PLY and PCD of the tests' own, from the formats' definitions: what other programs see.
namespace ipl_slam::testing {

static_assert(std::endian::native == std::endian::little);

template <class T>
T number_at(const std::string& bytes, std::size_t at) {
  if (at + sizeof(T) > bytes.size()) throw std::runtime_error("cut short");
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof(T));
  return value;
}

struct WrittenPly {
  std::vector<std::string> comments;
  std::map<std::string, std::vector<double>> vertices;  ///< a column per property
  std::vector<std::vector<int>> faces;
};

inline WrittenPly parse_written_ply(const std::string& bytes) {
  const std::string end = "end_header\n";
  std::size_t at = bytes.find(end) + end.size();
  std::istringstream head(bytes.substr(0, at));
  std::string line, element;
  std::map<std::string, std::size_t> counts;
  std::vector<std::pair<std::string, std::string>> properties;  // type, name
  WrittenPly ply;
  std::getline(head, line);
  if (line != "ply") throw std::runtime_error("no magic");
  std::getline(head, line);
  if (line != "format binary_little_endian 1.0") throw std::runtime_error(line);
  while (std::getline(head, line) && line != "end_header") {
    std::istringstream words(line);
    std::string key, a, b, c, d;
    words >> key >> a >> b >> c >> d;
    if (key == "comment") ply.comments.push_back(line.substr(8));
    if (key == "element") counts[element = a] = std::stoul(b);
    if (key == "property" && element == "vertex") properties.emplace_back(a, b);
    if (key == "property" && element == "face" && line != "property list uchar int vertex_indices") {
      throw std::runtime_error(line);
    }
  }
  for (std::size_t i = 0; i < counts["vertex"]; ++i) {
    for (const auto& [type, name] : properties) {
      if (type == "float")
        ply.vertices[name].push_back(number_at<float>(bytes, at)), at += 4;
      else if (type == "int")
        ply.vertices[name].push_back(number_at<std::int32_t>(bytes, at)), at += 4;
      else if (type == "uchar")
        ply.vertices[name].push_back(number_at<std::uint8_t>(bytes, at)), at += 1;
      else
        throw std::runtime_error(type);
    }
  }
  for (std::size_t i = 0; i < counts["face"]; ++i) {
    std::vector<int> face(number_at<std::uint8_t>(bytes, at++));
    for (int& vertex : face) vertex = number_at<std::int32_t>(bytes, at), at += 4;
    ply.faces.push_back(face);
  }
  if (at != bytes.size()) throw std::runtime_error("more follows than is announced");
  return ply;
}

struct WrittenPcd {
  std::map<std::string, std::string> head;
  std::vector<std::string> comments;
  std::string data;
};

inline WrittenPcd parse_written_pcd(const std::string& bytes) {
  WrittenPcd pcd;
  const std::string end = "DATA binary\n";
  const std::size_t at = bytes.find(end) + end.size();
  std::istringstream head(bytes.substr(0, at));
  for (std::string line; std::getline(head, line);) {
    if (line.starts_with("# "))
      pcd.comments.push_back(line.substr(2));
    else
      pcd.head[line.substr(0, line.find(' '))] = line.substr(line.find(' ') + 1);
  }
  pcd.data = bytes.substr(at);
  return pcd;
}

}  // namespace ipl_slam::testing
