#include "features/keypoint_depth.hpp"

#include <gtest/gtest.h>

#include "features/test_images.hpp"

namespace ipl_slam {
namespace {

class KeypointDepthTest : public ::testing::Test {
 protected:
  [[nodiscard]] float at(float u, float v) const {
    return keypoint_depth(depth, u, v, camera, noise, options);
  }
  std::uint16_t& raw(int x, int y) { return depth.at<std::uint16_t>(y, x); }

  Camera camera = test::simple_camera(40, 30);  // 5000 raw units a metre
  DepthNoiseOptions noise;
  KeypointDepthOptions options;
  cv::Mat depth = test::constant_depth(40, 30, 10000);
};

TEST_F(KeypointDepthTest, ReadsTheNearestPixel) {
  options.reject_edges = false;
  raw(20, 10) = 7500;
  EXPECT_FLOAT_EQ(at(20.4F, 9.6F), 1.5F);
  EXPECT_FLOAT_EQ(at(20.6F, 9.6F), 2.0F);
}

TEST_F(KeypointDepthTest, FillsAHoleFromItsNeighbourhoodOnly) {
  raw(20, 10) = 0;
  EXPECT_FLOAT_EQ(at(20, 10), 2.0F);
  depth(cv::Rect(19, 9, 3, 3)) = 0;
  EXPECT_EQ(at(20, 10), 0.0F);
  options.radius = 2;
  EXPECT_FLOAT_EQ(at(20, 10), 2.0F);
}

TEST_F(KeypointDepthTest, GivesNoDepthOnAnEdgeBetweenForegroundAndBackground) {
  depth(cv::Rect(0, 0, 20, 30)) = 5000;  // 1 m in front of 2 m
  EXPECT_EQ(at(19, 10), 0.0F);
  EXPECT_EQ(at(20, 10), 0.0F);
  EXPECT_FLOAT_EQ(at(18, 10), 1.0F);
  EXPECT_FLOAT_EQ(at(21, 10), 2.0F);
  options.reject_edges = false;
  EXPECT_FLOAT_EQ(at(19, 10), 1.0F);
  EXPECT_FLOAT_EQ(at(20, 10), 2.0F);
}

TEST_F(KeypointDepthTest, ASlopeIsNoEdge) {
  // 2 cm a pixel at 2 m: a wall seen at more than 80 degrees, 0.01 1/m over three pixels.
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 40; ++x) raw(x, y) = static_cast<std::uint16_t>(10000 + 100 * x);
  }
  EXPECT_FLOAT_EQ(at(20, 10), 2.4F);
}

TEST_F(KeypointDepthTest, LeavesOutDepthBeyondTheTrustedRange) {
  noise.max_depth = 1.9;
  EXPECT_EQ(at(20, 10), 0.0F);
}

TEST_F(KeypointDepthTest, IsDefinedAtAndBeyondTheImageBorder) {
  EXPECT_FLOAT_EQ(at(0, 0), 2.0F);
  EXPECT_FLOAT_EQ(at(39, 29), 2.0F);
  EXPECT_EQ(at(-5, 10), 0.0F);
  EXPECT_EQ(at(20, 500), 0.0F);
}

}  // namespace
}  // namespace ipl_slam
