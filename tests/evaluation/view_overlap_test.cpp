#include "evaluation/view_overlap.hpp"

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

Camera camera() {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 500.0;
  camera.cx = 319.5;
  camera.cy = 239.5;
  return camera;
}

// A wall across the view, `z` metres before the camera.
DepthView wall(double z, const SE3& T_wc = {}, const BitMask& moving = {}) {
  const cv::Mat depth(480, 640, CV_16UC1, cv::Scalar(z * camera().depth_scale));
  return make_depth_view(depth, T_wc, camera(), moving);
}

SE3 moved(double x, double z) {
  return {Eigen::Quaterniond::Identity(), Eigen::Vector3d(x, 0, z)};
}

// One of the 40 x 30 samples that are tried, in a row of them.
constexpr double kSample = 1.0 / 40;

TEST(ViewOverlap, a_view_sees_all_of_itself) {
  EXPECT_DOUBLE_EQ(seen_share(wall(2.0), wall(2.0), camera()), 1.0);
}

TEST(ViewOverlap, a_step_aside_leaves_what_the_shift_leaves) {
  // 0.64 m aside before a wall at 2 m: 160 of 640 pixels.
  EXPECT_NEAR(seen_share(wall(2.0), wall(2.0, moved(0.64, 0)), camera()), 0.75, kSample);
}

TEST(ViewOverlap, from_nearer_a_part_is_seen_and_from_farther_all) {
  const DepthView far = wall(4.0), near = wall(2.0, moved(0, 2.0));
  EXPECT_NEAR(seen_share(far, near, camera()), 0.25, 2 * kSample);
  EXPECT_DOUBLE_EQ(seen_share(near, far, camera()), 1.0);
}

TEST(ViewOverlap, what_stands_behind_something_is_not_seen) {
  EXPECT_DOUBLE_EQ(seen_share(wall(3.0), wall(2.0), camera()), 0.0);
}

TEST(ViewOverlap, a_camera_that_looks_away_sees_nothing) {
  const SE3 turned(Eigen::Quaterniond(Eigen::AngleAxisd(3.14159, Eigen::Vector3d::UnitY())),
                   Eigen::Vector3d::Zero());
  EXPECT_DOUBLE_EQ(seen_share(wall(2.0), wall(2.0, turned), camera()), 0.0);
}

TEST(ViewOverlap, what_moves_and_what_has_no_depth_is_left_out) {
  cv::Mat image = cv::Mat::zeros(480, 640, CV_8UC1);
  image(cv::Rect(0, 0, 320, 480)).setTo(255);
  const DepthView half = wall(2.0, {}, BitMask::from_image(image));
  EXPECT_DOUBLE_EQ(seen_share(half, wall(2.0), camera()), 1.0);
  EXPECT_NEAR(seen_share(wall(2.0), half, camera()), 0.5, kSample);
  EXPECT_DOUBLE_EQ(seen_share(wall(0.0), wall(2.0), camera()), 0.0);
}

}  // namespace
}  // namespace ipl_slam
