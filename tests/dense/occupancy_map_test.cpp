#include "dense/occupancy_map.hpp"

#include <cmath>
#include <numbers>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <yaml-cpp/yaml.h>

#include <ipl_slam/error.hpp>

namespace ipl_slam {
namespace {

OccupancyOptions tenths() {
  OccupancyOptions options;
  options.cell = 0.1;
  options.min_points = 1;
  return options;
}

std::vector<CloudPoint> points(const std::vector<Eigen::Vector3f>& positions) {
  std::vector<CloudPoint> result(positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i) result[i].position = positions[i];
  return result;
}

// Floor, an obstacle at (0.35, 0.25), a lamp over (0.55, 0.25), another obstacle at (-0.15, -0.05).
OccupancyGrid small_world() {
  OccupancyGrid grid(tenths());
  grid.add_points(
      points({{0.35F, 0.25F, 0.5F}, {0.55F, 0.25F, 2.2F}, {0.15F, 0.15F, 0.0F}, {-0.15F, -0.05F, 1.75F}}));
  return grid;
}

TEST(OccupancyMap, ShowsObstaclesBetweenTheTwoHeights) {
  const OccupancyMap map = occupancy_map(small_world());
  ASSERT_EQ(map.image.size(), cv::Size(6, 4));  // x from -0.2 to 0.4, y from -0.1 to 0.3
  EXPECT_EQ(map.image.at<std::uint8_t>(0, 5), OccupancyMap::kOccupied)
      << "the greatest y is in the first row";
  EXPECT_EQ(map.image.at<std::uint8_t>(3, 0), OccupancyMap::kOccupied);
  EXPECT_EQ(cv::countNonZero(map.image == OccupancyMap::kUnknown), 22);
  EXPECT_DOUBLE_EQ(map.resolution, 0.1);
  EXPECT_NEAR(map.x, -0.2, 1e-12);
  EXPECT_NEAR(map.y, -0.1, 1e-12);
  OccupancyMapOptions higher;
  higher.high = 2.5;
  EXPECT_EQ(occupancy_map(small_world(), higher).image.cols, 8) << "with the lamp";
}

TEST(OccupancyMap, IsFreeWhereRaysPassAndNothingStands) {
  OccupancyGrid grid(tenths());
  Camera camera;
  camera.width = 64, camera.height = 48;
  camera.fx = camera.fy = 60.0, camera.cx = 31.5, camera.cy = 23.5;
  const cv::Size size(64, 48);
  const RangeImage view{cv::Mat(size, CV_32FC1, cv::Scalar(2)), cv::Mat(size, CV_32FC1, cv::Scalar(1)),
                        cv::Mat(size, CV_32FC1, cv::Scalar(2))};
  Eigen::Matrix3d R;  // looks along x, z up
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  grid.add_rays(view, camera, SE3(R, {0, 0, 1}));
  grid.add_points(points({{1.05F, 0.05F, 1.0F}}));
  const OccupancyMap map = occupancy_map(grid);
  const auto at = [&](double x, double y) {
    const int column = static_cast<int>(std::floor((x - map.x) / map.resolution));
    const int row = map.image.rows - 1 - static_cast<int>(std::floor((y - map.y) / map.resolution));
    return static_cast<int>(map.image.at<std::uint8_t>(row, column));
  };
  EXPECT_EQ(at(0.55, 0.05), OccupancyMap::kFree);
  EXPECT_EQ(at(1.05, 0.05), OccupancyMap::kOccupied) << "though rays pass above";
  EXPECT_EQ(at(1.55, 0.05), OccupancyMap::kFree);
  EXPECT_EQ(at(0.05, 0.85), OccupancyMap::kUnknown);
}

TEST(OccupancyMap, IsWrittenAsMapServerReadsIt) {
  const OccupancyMap map = occupancy_map(small_world());
  const std::string pgm = map_pgm(map);
  const std::string head = "P5\n6 4\n255\n";
  EXPECT_EQ(pgm.substr(0, head.size()), head);
  EXPECT_EQ(pgm.size(), head.size() + 24);
  const cv::Mat again =
      cv::imdecode(std::vector<unsigned char>(pgm.begin(), pgm.end()), cv::IMREAD_UNCHANGED);
  EXPECT_EQ(cv::norm(again, map.image, cv::NORM_INF), 0.0);

  const std::string text = map_yaml(map, "map.pgm");
  const YAML::Node yaml = YAML::Load(text);
  EXPECT_EQ(yaml["image"].as<std::string>(), "map.pgm");
  EXPECT_DOUBLE_EQ(yaml["resolution"].as<double>(), 0.1);
  EXPECT_NEAR(yaml["origin"][0].as<double>(), -0.2, 1e-6);
  EXPECT_NEAR(yaml["origin"][1].as<double>(), -0.1, 1e-6);
  EXPECT_EQ(yaml["origin"][2].as<double>(), 0.0);
  EXPECT_EQ(yaml["negate"].as<int>(), 0);
  // map_server: p = (255 - value) / 255; occupied above the one, free below the other, else unknown.
  const double occupied = yaml["occupied_thresh"].as<double>(), free = yaml["free_thresh"].as<double>();
  EXPECT_GT((255 - OccupancyMap::kOccupied) / 255.0, occupied);
  EXPECT_LT((255 - OccupancyMap::kFree) / 255.0, free);
  EXPECT_GT((255 - OccupancyMap::kUnknown) / 255.0, free);
  EXPECT_LT((255 - OccupancyMap::kUnknown) / 255.0, occupied);
}

TEST(OccupancyMap, SaysHowItLiesInTheWorld) {
  const SE3 T_gw(Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX())),
                 {0, 0, 1.5});
  OccupancyGrid grid(tenths(), T_gw);
  grid.add_points(points({{0, 0.5F, 0}}));
  const std::string text = map_yaml(occupancy_map(grid, {-10, 10}), "m.pgm");
  const std::string key = "tx ty tz qx qy qz qw: ";
  std::istringstream numbers(text.substr(text.find(key) + key.size()));
  double tx, ty, tz, qx, qy, qz, qw;
  numbers >> tx >> ty >> tz >> qx >> qy >> qz >> qw;
  const SE3 read(Eigen::Quaterniond(qw, qx, qy, qz), {tx, ty, tz});
  EXPECT_LT((read * T_gw.inverse()).log().norm(), 1e-6);
}

TEST(OccupancyMap, RefusesWhatMakesNoMap) {
  EXPECT_THROW((void)occupancy_map(OccupancyGrid(tenths())), UserError);
  OccupancyGrid wide(tenths());
  wide.add_points(points({{-5000, -5000, 1}, {5000, 5000, 1}}));
  EXPECT_THROW((void)occupancy_map(wide), UserError);
}

}  // namespace
}  // namespace ipl_slam
