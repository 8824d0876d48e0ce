#include "dense/upright.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "support/rendered_sequence.hpp"
#include "support/true_cloud.hpp"

namespace ipl_slam {
namespace {

using testing::true_cloud;
using testing::TrueCloud;

constexpr double kDegree = std::numbers::pi / 180.0;

double degrees_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::acos(std::clamp(a.normalized().dot(b.normalized()), -1.0, 1.0)) / kDegree;
}

// The room as the map sees it: the world is the first camera, which looks down a little and leans by `roll`.
struct Room {
  explicit Room(double roll) {
    static const TrueCloud scene = [] {
      SyntheticOptions options = testing::small_room(40, "orbit");
      options.color_noise = options.depth_noise = false;
      return true_cloud(options, 10, 0.03);
    }();
    const SE3 leaning(Eigen::Quaterniond(Eigen::AngleAxisd(roll * kDegree, Eigen::Vector3d::UnitZ())),
                      Eigen::Vector3d::Zero());
    T_ws = leaning * scene.trajectory.front().T_wc.inverse();
    shown = scene;
    for (CloudPoint& point : shown.cloud.points) {
      point.position = (T_ws * point.position.cast<double>()).cast<float>();
      point.normal = (T_ws.rotation() * point.normal.cast<double>()).cast<float>();
    }
    for (StampedPose& pose : shown.trajectory) pose.T_wc = T_ws * pose.T_wc;
  }
  SE3 T_ws;  // from the scene, which has z up, the floor at 0 and walls along x and y
  TrueCloud shown;
};

// How far from a multiple of a right angle two directions are.
double off_right_angle(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::abs(std::remainder(degrees_between(a, b), 90.0));
}

TEST(Upright, FindsFloorAndWallsOfATiltedRoom) {
  for (const double roll : {0.0, 12.0, -20.0}) {
    const Room room(roll);
    const Upright upright = upright_frame(room.shown.cloud, room.shown.trajectory);
    EXPECT_TRUE(upright.level_was_found && upright.floor_was_found && upright.walls_were_found);
    const SE3 T_us = upright.T_uw * room.T_ws;
    const Eigen::Matrix3d R_us = T_us.rotation_matrix();
    // Normals come from depth in floats, over one pixel: some 0.1 degrees each, far less in the mean.
    EXPECT_LT(degrees_between(R_us.col(2), Eigen::Vector3d::UnitZ()), 0.2) << roll;
    EXPECT_LT(off_right_angle(R_us.col(0), Eigen::Vector3d::UnitX()), 0.5) << roll;
    EXPECT_NEAR(T_us.translation().z(), 0.0, 0.01) << "the scene's floor is at height 0";
    // Of the four ways along the walls, x is the one nearest to the first camera's.
    const Eigen::Vector3d ahead =
        upright.T_uw.rotation() * room.shown.trajectory.front().T_wc.rotation_matrix().col(2);
    EXPECT_LT(std::abs(std::atan2(ahead.y(), ahead.x())), 46.0 * kDegree);
  }
}

TEST(Upright, ManagesWithoutTheTrajectory) {
  const Room room(10.0);
  const Upright upright = upright_frame(room.shown.cloud, {});
  EXPECT_TRUE(upright.level_was_found);
  const Eigen::Vector3d up = (upright.T_uw * room.T_ws).rotation_matrix().col(2);
  EXPECT_LT(degrees_between(up, Eigen::Vector3d::UnitZ()), 0.2);
}

TEST(Upright, SaysWhereItCannotTell) {
  Room room(0.0);
  const Upright known = upright_frame(room.shown.cloud, room.shown.trajectory);
  for (CloudPoint& point : room.shown.cloud.points) point.normal.setZero();
  const Upright guess = upright_frame(room.shown.cloud, room.shown.trajectory);
  EXPECT_FALSE(guess.level_was_found || guess.floor_was_found || guess.walls_were_found);
  // The cameras' mean up and the lowest points are still near.
  EXPECT_LT(degrees_between(guess.T_uw.rotation_matrix().row(2), known.T_uw.rotation_matrix().row(2)), 35.0);

  EXPECT_FALSE(upright_frame({}, {}).level_was_found);
  EXPECT_EQ(upright_frame({}, {}).T_uw.translation(), Eigen::Vector3d::Zero());
}

TEST(Upright, TakesATableForNoFloorWhereMuchLiesUnderIt) {
  // A table of 1 x 1 m, 0.7 m up, and the lower half of a wall beside it; no floor. z is up.
  SemanticCloud cloud;
  for (int i = 0; i < 50; ++i) {
    for (int k = 0; k < 50; ++k) {
      const float a = 0.02F * static_cast<float>(i), b = 0.02F * static_cast<float>(k);
      CloudPoint table, wall;
      table.position = {a, b, 0.7F};
      table.normal = Eigen::Vector3f::UnitZ();
      wall.position = {2.0F, a, 1.4F * b};
      wall.normal = -Eigen::Vector3f::UnitX();
      cloud.points.insert(cloud.points.end(), {table, wall});
    }
  }
  const Upright upright = upright_frame(cloud, {}, {}, Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitX());
  EXPECT_TRUE(upright.level_was_found);
  EXPECT_FALSE(upright.floor_was_found);
  EXPECT_NEAR(upright.T_uw.translation().z(), 0.0, 1e-3) << "the lowest points are taken instead";

  // Without what is under it it passes for the floor: nothing tells the two apart.
  std::erase_if(cloud.points, [](const CloudPoint& p) { return p.position.z() < 0.65F; });
  EXPECT_TRUE(
      upright_frame(cloud, {}, {}, Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitX()).floor_was_found);
}

}  // namespace
}  // namespace ipl_slam
