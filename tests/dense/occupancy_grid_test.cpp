#include "dense/occupancy_grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <ipl_slam/error.hpp>

#include "common/random.hpp"

namespace ipl_slam {
namespace {

// 160x120, 60 pixels per metre at 1 m.
Camera small_camera() {
  Camera camera;
  camera.width = 160, camera.height = 120;
  camera.fx = camera.fy = 120.0;
  camera.cx = 79.5, camera.cy = 59.5;
  return camera;
}

// A wall at a depth, seen head on.
RangeImage wall(float depth) {
  const cv::Size size(160, 120);
  return {cv::Mat(size, CV_32FC1, cv::Scalar(depth)), cv::Mat(size, CV_32FC1, cv::Scalar(1)),
          cv::Mat(size, CV_32FC1, cv::Scalar(depth))};
}

// A camera beside the first one.
SE3 moved(double x) {
  return {Eigen::Quaterniond::Identity(), Eigen::Vector3d(x, 0.0, 0.0)};
}

CloudPoint point_at(float x, float y, float z) {
  CloudPoint point;
  point.position = {x, y, z};
  return point;
}

TEST(OccupancyGrid, IsOccupiedWhereEnoughPointsAre) {
  OccupancyGrid grid(OccupancyOptions{});
  grid.add_points({point_at(0.01F, 0.01F, 0.01F), point_at(-0.01F, 0.01F, 0.01F)});
  EXPECT_EQ(grid.at({0.02, 0.02, 0.02}), Occupancy::kUnknown) << "one point is no surface";
  grid.add_points({point_at(0.04F, 0.04F, 0.04F)});
  EXPECT_EQ(grid.at({0.02, 0.02, 0.02}), Occupancy::kOccupied);
  EXPECT_EQ(grid.at({-0.02, 0.02, 0.02}), Occupancy::kUnknown);
  ASSERT_EQ(grid.cells().size(), 1U);
  EXPECT_EQ(grid.cells()[0].place, (VoxelCoord{0, 0, 0}));
}

TEST(OccupancyGrid, IsFreeBeforeASurfaceAndUnknownBehindIt) {
  OccupancyGrid grid(OccupancyOptions{});
  grid.add_rays(wall(2.0F), small_camera(), {});
  for (double z = 0.1; z < 1.9; z += 0.05) EXPECT_EQ(grid.at({0.02, 0.02, z}), Occupancy::kFree) << z;
  for (double z = 2.0; z < 4.0; z += 0.05) EXPECT_EQ(grid.at({0.02, 0.02, z}), Occupancy::kUnknown) << z;
  EXPECT_EQ(grid.at({2.0, 0.02, 1.0}), Occupancy::kUnknown) << "outside the view";
  EXPECT_EQ(grid.at({0.02, 0.02, -0.1}), Occupancy::kUnknown) << "behind the camera";
  grid.add_points({point_at(0.02F, 0.02F, 1.02F), point_at(0.03F, 0.02F, 1.02F)});
  EXPECT_EQ(grid.at({0.02, 0.02, 1.02}), Occupancy::kOccupied) << "the cloud has the last word";
}

TEST(OccupancyGrid, FollowsRaysNoFurtherThanAsked) {
  OccupancyOptions options;
  options.max_range = 1.0;
  OccupancyGrid grid(options);
  grid.add_rays(wall(3.0F), small_camera(), {});
  EXPECT_EQ(grid.at({0.02, 0.02, 0.9}), Occupancy::kFree);
  EXPECT_EQ(grid.at({0.02, 0.02, 1.1}), Occupancy::kUnknown);
}

TEST(OccupancyGrid, LooksPastWhomIsLeftOutAsFarAsIsKnown) {
  OccupancyGrid grid(OccupancyOptions{});
  RangeImage view = wall(2.0F);
  view.depth.setTo(0.0F);
  view.reach.setTo(1.5F);
  grid.add_rays(view, small_camera(), {});
  EXPECT_EQ(grid.at({0.02, 0.02, 1.4}), Occupancy::kFree);
  EXPECT_EQ(grid.at({0.02, 0.02, 1.6}), Occupancy::kUnknown);
  view.reach.setTo(0.0F);
  OccupancyGrid nothing(OccupancyOptions{});
  nothing.add_rays(view, small_camera(), {});
  EXPECT_TRUE(nothing.cells().empty());
}

TEST(OccupancyGrid, PassesThroughEveryCellOnTheWay) {
  // Against dense sampling of the same rays.
  OccupancyOptions options;
  options.every = 40;
  const SE3 T_wc(Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized())),
                 {0.313, -0.127, 0.771});
  OccupancyGrid grid(options);
  grid.add_rays(wall(2.0F), small_camera(), T_wc);
  std::vector<VoxelCoord> expected;
  const Camera camera = small_camera();
  for (int v = 20; v < 120; v += 40) {
    for (int u = 20; u < 160; u += 40) {
      const Eigen::Vector3d ray = camera.unproject({u, v}, 1.0);
      const double end = std::min(2.0 - options.cell / ray.norm(), options.max_range / ray.norm());
      for (int i = 0; i <= 20000; ++i) {
        const Eigen::Vector3d p = (T_wc * (end * i / 20000.0 * ray) / options.cell).array().floor();
        expected.push_back({static_cast<int>(p.x()), static_cast<int>(p.y()), static_cast<int>(p.z())});
      }
    }
  }
  std::sort(expected.begin(), expected.end());
  expected.erase(std::unique(expected.begin(), expected.end()), expected.end());
  const std::vector<OccupancyGrid::Cell> cells = grid.cells();
  std::size_t found = 0;
  for (const VoxelCoord& place : expected) {
    found += std::any_of(cells.begin(), cells.end(), [&](const auto& cell) { return cell.place == place; })
                 ? 1
                 : 0;
  }
  EXPECT_EQ(found, expected.size());
  // Corners that a ray cuts by less than a 20000th of its length are missed by the samples.
  EXPECT_LE(cells.size(), expected.size() + 3);
}

TEST(OccupancyGrid, HasAxesOfItsOwn) {
  const SE3 T_gw(Eigen::Quaterniond(Eigen::AngleAxisd(-std::numbers::pi / 2, Eigen::Vector3d::UnitX())),
                 {0, 0, 1});
  OccupancyGrid grid(OccupancyOptions{}, T_gw);
  grid.add_points({point_at(0.02F, -1.02F, 3.02F), point_at(0.03F, -1.02F, 3.02F)});
  grid.add_rays(wall(2.0F), small_camera(), {});
  EXPECT_EQ(grid.at(T_gw * Eigen::Vector3d(0.02, -1.02, 3.02)), Occupancy::kOccupied);
  EXPECT_EQ(grid.at(T_gw * Eigen::Vector3d(0.02, 0.02, 1.0)), Occupancy::kFree);
}

TEST(OccupancyGrid, DoesNotDependOnTheOrder) {
  Random random(3);
  std::vector<CloudPoint> points;
  for (int i = 0; i < 2000; ++i) {
    points.push_back(point_at(static_cast<float>(random.uniform(-1, 1)),
                              static_cast<float>(random.uniform(-1, 1)),
                              static_cast<float>(random.uniform(0, 2))));
  }
  const SE3 aside = moved(0.5);
  OccupancyGrid a(OccupancyOptions{}), b(OccupancyOptions{});
  a.add_points(points);
  a.add_rays(wall(1.0F), small_camera(), {});
  a.add_rays(wall(2.0F), small_camera(), aside);
  b.add_rays(wall(2.0F), small_camera(), aside);
  b.add_rays(wall(1.0F), small_camera(), {});
  std::reverse(points.begin(), points.end());
  b.add_points(points);
  const auto first = a.cells(), second = b.cells();
  ASSERT_EQ(first.size(), second.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].place, second[i].place);
    EXPECT_EQ(first[i].state, second[i].state);
    if (i > 0) {
      EXPECT_LT(first[i - 1].place, first[i].place);
    }
  }
}

TEST(OccupancyGrid, LeavesOutWhatIsAbsurdlyFarAway) {
  OccupancyGrid grid(OccupancyOptions{});
  for (const float far : {1e6F, 1e30F, std::numeric_limits<float>::infinity()}) {
    grid.add_points({point_at(far, 0, 0), point_at(far, 0, 0)});
    grid.add_rays(wall(1.0F), small_camera(), moved(static_cast<double>(far)));
  }
  EXPECT_TRUE(grid.cells().empty());
}

TEST(OccupancyGrid, RefusesSettingsOutOfRange) {
  OccupancyOptions options;
  options.cell = 0.0;
  EXPECT_THROW(OccupancyGrid{options}, UserError);
}

}  // namespace
}  // namespace ipl_slam
