#include "pipeline/lines_ply.hpp"

#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/line_world.hpp"

namespace ipl_slam {
namespace {

using namespace test;

// A text PLY file as any reader would see it: per element its rows, each a value per property name.
struct Ply {
  using Row = std::map<std::string, double>;

  explicit Ply(const std::string& text) {
    std::istringstream in(text);
    std::string line, word;
    std::getline(in, line);
    EXPECT_EQ(line, "ply");
    std::getline(in, line);
    EXPECT_EQ(line, "format ascii 1.0");
    std::vector<Element> elements;
    while (std::getline(in, line) && line != "end_header") {
      std::istringstream words(line);
      words >> word;
      if (word == "element") {
        Element element;
        words >> element.name >> element.count;
        elements.push_back(element);
      } else if (word == "property") {
        std::string type, name;
        words >> type >> name;
        elements.back().properties.push_back(name);
      } else {
        EXPECT_EQ(word, "comment");
      }
    }
    EXPECT_EQ(line, "end_header");
    for (const Element& element : elements) read(in, element);
    EXPECT_FALSE(in >> word) << "more than the header announces";
  }

  std::map<std::string, std::vector<Row>> rows;

 private:
  struct Element {
    std::string name;
    std::size_t count = 0;
    std::vector<std::string> properties;
  };

  void read(std::istream& in, const Element& element) {
    std::vector<Row>& list = rows[element.name];
    for (std::size_t i = 0; i < element.count; ++i) {
      std::string line;
      ASSERT_TRUE(std::getline(in, line)) << "less than the header announces";
      std::istringstream values(line);
      Row row;
      for (const std::string& property : element.properties) ASSERT_TRUE(values >> row[property]) << line;
      std::string rest;
      EXPECT_FALSE(values >> rest) << line;
      list.push_back(row);
    }
  }
};

TEST(LinesPly, OfAMapWithoutLinesIsEmptyButWhole) {
  Map map(kTestPyramid);
  map.add_keyframe(SyntheticWorld::make_frame({}), SE3{});
  Ply ply(lines_ply(map));
  EXPECT_EQ(ply.rows.size(), 2U);
  EXPECT_TRUE(ply.rows.at("vertex").empty());
  EXPECT_TRUE(ply.rows.at("edge").empty());
}

TEST(LinesPly, JoinsTheTwoEndsOfEveryLine) {
  const LineWorld world;
  LineWorldMap map(world);
  map.add(world.look(camera_at({0.0, 0.0, 0.0}), 0));
  map.add(world.look(camera_at({0.1, 0.0, 0.0}, 0.2), 1));
  map.map.remove(LineId{0});
  map.map.remove(LineId{7});
  Ply ply(lines_ply(map.map));
  const auto &vertices = ply.rows.at("vertex"), &edges = ply.rows.at("edge");
  ASSERT_EQ(edges.size(), map.map.lines().size());
  ASSERT_EQ(vertices.size(), 2 * edges.size());
  std::size_t i = 0;
  bool seen_once = false, seen_twice = false;
  map.map.lines().for_each([&](LineId id, const Line& line) {
    const Ply::Row& edge = edges[i++];
    EXPECT_EQ(edge.at("id"), id.value);
    EXPECT_EQ(edge.at("part"), 0);
    EXPECT_EQ(edge.at("observations"), static_cast<double>(line.observations.size()));
    (line.observations.size() > 1 ? seen_twice : seen_once) = true;
    const auto end = [&](const char* which) -> Eigen::Vector3d {
      const Ply::Row& vertex = vertices.at(static_cast<std::size_t>(edge.at(which)));
      return {vertex.at("x"), vertex.at("y"), vertex.at("z")};
    };
    // Six decimals are written.
    EXPECT_LT((end("vertex1") - line.start).cwiseAbs().maxCoeff(), 6e-7);
    EXPECT_LT((end("vertex2") - line.end).cwiseAbs().maxCoeff(), 6e-7);
  });
  EXPECT_TRUE(seen_once && seen_twice) << "both kinds should have been there";
}

}  // namespace
}  // namespace ipl_slam
