#include "dense/octomap_file.hpp"

#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <octomap/OcTree.h>

namespace ipl_slam {
namespace {

OccupancyGrid small_world() {
  OccupancyOptions options;
  options.min_points = 1;
  OccupancyGrid grid(options);
  std::vector<CloudPoint> points(3);
  points[0].position = {0.51F, -0.26F, 1.01F};
  points[1].position = {-0.01F, -0.01F, 1.3F};
  points[2].position = {4e4F, 0, 0};  // further than a tree reaches
  grid.add_points(points);
  Camera camera;
  camera.width = 64, camera.height = 48;
  camera.fx = camera.fy = 60.0, camera.cx = 31.5, camera.cy = 23.5;
  const cv::Size size(64, 48);
  grid.add_rays({cv::Mat(size, CV_32FC1, cv::Scalar(1)), cv::Mat(size, CV_32FC1, cv::Scalar(1)),
                 cv::Mat(size, CV_32FC1, cv::Scalar(1))},
                camera, {});
  return grid;
}

TEST(OctomapFile, BeginsAsTheFormatSays) {
  const std::string bytes = octomap_bt(small_world());
  std::istringstream lines(bytes);
  std::string first, id, size, res, word;
  std::getline(lines, first);
  EXPECT_EQ(first, "# Octomap OcTree binary file");
  while (lines.peek() == '#') std::getline(lines, word);
  std::size_t nodes = 0;
  double cell = 0.0;
  lines >> id >> word >> size >> nodes >> res >> cell >> word;
  EXPECT_EQ(id, "id");
  EXPECT_EQ(size, "size");
  EXPECT_EQ(res, "res");
  EXPECT_EQ(cell, 0.05);
  EXPECT_EQ(word, "data");
  // A node is 16 bits, two for each of its children; leaves are in their parents only.
  const std::size_t data = bytes.size() - bytes.find("data\n") - 5;
  EXPECT_EQ(data % 2, 0U);
  EXPECT_GT(data, 0U);
  EXPECT_LT(data / 2, nodes);
}

TEST(OctomapFile, IsReadBackByOctomapCellByCell) {
  const OccupancyGrid grid = small_world();
  octomap::OcTree tree(0.1);
  std::istringstream bytes(octomap_bt(grid));
  ASSERT_TRUE(tree.readBinary(bytes));
  EXPECT_DOUBLE_EQ(tree.getResolution(), 0.05);
  std::size_t free = 0, occupied = 0;
  for (const OccupancyGrid::Cell& cell : grid.cells()) {
    const Eigen::Vector3d centre = grid.low_corner(cell.place).array() + 0.025;
    if (centre.x() > 3e4) continue;
    const octomap::OcTreeNode* node = tree.search(centre.x(), centre.y(), centre.z());
    ASSERT_NE(node, nullptr);
    const bool is_occupied = cell.state == Occupancy::kOccupied;
    EXPECT_EQ(tree.isNodeOccupied(node), is_occupied);
    ++(is_occupied ? occupied : free);
  }
  EXPECT_EQ(occupied, 2U);
  EXPECT_GT(free, 1000U);
  // And there is no more in it.
  tree.expand();
  EXPECT_EQ(tree.getNumLeafNodes(), occupied + free);
}

TEST(OctomapFile, IsTheSameTwice) {
  EXPECT_EQ(octomap_bt(small_world()), octomap_bt(small_world()));
  EXPECT_THAT(octomap_bt(OccupancyGrid(OccupancyOptions{})), ::testing::HasSubstr("size 0"));
}

}  // namespace
}  // namespace ipl_slam
