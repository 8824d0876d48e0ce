#include "pipeline/feature_overlay.hpp"

#include <cmath>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "pipeline/weight_colors.hpp"
#include "support/synthetic_world.hpp"

namespace ipl_slam {
namespace {

using namespace test;

// A lens that moves the corners of the image by tens of pixels.
Camera bent_camera() {
  Camera camera = kTestCamera;
  camera.k1 = -0.15;
  return camera;
}

cv::Mat black() {
  return cv::Mat::zeros(480, 640, CV_8UC3);
}

cv::Vec3b at(const cv::Mat& picture, const Eigen::Vector2d& uv) {
  return picture.at<cv::Vec3b>(static_cast<int>(std::lround(uv.y())), static_cast<int>(std::lround(uv.x())));
}

const cv::Vec3b kBlack(0, 0, 0);

bool is_blue(const cv::Vec3b& c) {
  return c[0] > 150 && c[0] > c[1] + 50 && c[1] > c[2];
}
bool is_green(const cv::Vec3b& c) {
  return c[1] > 150 && c[1] > c[0] + 50 && c[1] > c[2] + 50;
}
bool is_red(const cv::Vec3b& c) {
  return c[2] > 150 && c[2] > c[0] + 100 && c[2] > c[1] + 100;
}
bool is_yellow(const cv::Vec3b& c) {
  return c[2] > 150 && c[1] > 150 && c[0] < 100;
}
bool is_purple(const cv::Vec3b& c) {
  return c[2] > 120 && c[0] > 120 && c[1] < 100;
}
bool is_grey(const cv::Vec3b& c) {
  return c[0] > 60 && c[0] == c[1] && c[1] == c[2];
}

// A frame with a keypoint at each pixel (as it lies in the image); every other one sees a landmark.
TrackedFrame frame_with(const std::vector<Eigen::Vector2d>& pixels, const Camera& camera) {
  Features features;
  for (const Eigen::Vector2d& pixel : pixels) {
    Keypoint keypoint;
    keypoint.pixel = pixel.cast<float>();
    keypoint.undistorted = camera.undistort(pixel).cast<float>();
    features.keypoints.push_back(keypoint);
    features.descriptors.emplace_back();
  }
  TrackedFrame frame;
  frame.points.resize(pixels.size());
  for (std::uint32_t k = 0; k < pixels.size(); k += 2) frame.points[k] = PointId{k};
  frame.frame = SyntheticWorld::make_frame(std::move(features));
  return frame;
}

TEST(FeatureOverlay, TellsKeypointsWithAndWithoutALandmarkByColour) {
  const Camera camera = bent_camera();
  const TrackedFrame frame = frame_with({{40, 30}, {600, 30}, {600, 450}, {320, 240}}, camera);
  cv::Mat picture = black();
  draw_features(picture, frame, {}, camera);
  EXPECT_TRUE(is_green(at(picture, {40, 30})));
  EXPECT_TRUE(is_grey(at(picture, {600, 30})));
  EXPECT_TRUE(is_green(at(picture, {600, 450})));
  EXPECT_TRUE(is_grey(at(picture, {320, 240})));
  EXPECT_EQ(at(picture, {100, 300}), kBlack);
  // Dots, not blots.
  EXPECT_EQ(at(picture, {46, 30}), kBlack);
  EXPECT_EQ(at(picture, {320, 246}), kBlack);
}

TEST(FeatureOverlay, AMatchedKeypointLiesOnTop) {
  const TrackedFrame frame = frame_with({{100, 100}, {100, 100}}, kTestCamera);
  cv::Mat picture = black();
  draw_features(picture, frame, {}, kTestCamera);
  EXPECT_TRUE(is_green(at(picture, {100, 100})));
}

TEST(FeatureOverlay, DrawsLinesInBlue) {
  TrackedFrame frame = frame_with({}, kTestCamera);
  frame.lines.push_back({LineId{3}, {100, 200}, {300, 260}});
  cv::Mat picture = black();
  draw_features(picture, frame, {}, kTestCamera);
  for (const double share : {0.2, 0.5, 0.8}) {
    EXPECT_TRUE(is_blue(at(picture, {100 + 200 * share, 200 + 60 * share}))) << share;
  }
  EXPECT_EQ(at(picture, {200, 222}), kBlack) << "beside it";
  EXPECT_EQ(at(picture, {90, 197}), kBlack) << "before its start";
  EXPECT_EQ(at(picture, {310, 263}), kBlack) << "beyond its end";
  // The ends are marked, brighter than the line.
  for (const Eigen::Vector2d& end : {frame.lines[0].start, frame.lines[0].end}) {
    EXPECT_GT(at(picture, end)[1], 200);
  }
}

TEST(FeatureOverlay, LinesBendAsTheImageDoes) {
  const Camera camera = bent_camera();
  TrackedFrame frame = frame_with({}, camera);
  // Along the upper border, where the lens bends most.
  const Eigen::Vector2d start = camera.undistort({20, 20}), end = camera.undistort({620, 20});
  frame.lines.push_back({LineId{0}, start, end});
  cv::Mat picture = black();
  draw_features(picture, frame, {}, camera);
  for (const double share : {0.1, 0.25, 0.5, 0.75, 0.9}) {
    const Eigen::Vector2d uv = start + share * (end - start);
    EXPECT_TRUE(is_blue(at(picture, camera.distort(uv)))) << share;
  }
  // Halfway between its ends the straight line would lie some pixels below the bent one.
  const Eigen::Vector2d middle = camera.distort(0.5 * (start + end));
  ASSERT_GT(std::abs(middle.y() - 20.0), 8.0);
  EXPECT_EQ(at(picture, {middle.x(), 20.0}), kBlack);
}

TEST(FeatureOverlay, WhatLiesOutsideThePictureDoesNoHarm) {
  TrackedFrame frame = frame_with({}, kTestCamera);
  frame.lines.push_back({LineId{0}, {-500, 100}, {900, 100}});
  frame.lines.push_back({LineId{1}, {-50, -50}, {-20, -80}});
  cv::Mat picture = black();
  draw_features(picture, frame, {}, kTestCamera);
  EXPECT_TRUE(is_blue(at(picture, {320, 100})));
}

TEST(FeatureOverlay, ColoursMatchedKeypointsByWeight) {
  // Every other one is matched.
  const TrackedFrame frame =
      frame_with({{50, 50}, {5, 5}, {100, 50}, {5, 5}, {150, 50}, {5, 5}, {200, 50}, {250, 50}}, kTestCamera);
  FeatureWeights weights;
  weights.points = {1.0, 0.5, 0.5, 0.5, 0.02, 0.5, 0.0, 0.5};
  cv::Mat picture = black();
  draw_features(picture, frame, weights, kTestCamera);
  EXPECT_TRUE(is_green(at(picture, {50, 50})));
  EXPECT_TRUE(is_yellow(at(picture, {100, 50})));
  EXPECT_TRUE(is_red(at(picture, {150, 50})));
  EXPECT_TRUE(is_grey(at(picture, {250, 50}))) << "not matched: its weight was of no use";
  // The one of weight 0 is a cross: its arms reach farther than a dot, and there is nothing between them.
  EXPECT_TRUE(is_red(at(picture, {203, 53})));
  EXPECT_TRUE(is_red(at(picture, {197, 53})));
  EXPECT_FALSE(is_red(at(picture, {203, 50})));
  EXPECT_FALSE(is_red(at(picture, {153, 53})));
}

TEST(FeatureOverlay, CrossesOutWhatWasRemovedWithoutAMatchToo) {
  const TrackedFrame frame = frame_with({{100, 100}, {300, 100}}, kTestCamera);
  FeatureWeights weights;
  weights.points = {1.0, 0.0};
  cv::Mat picture = black();
  draw_features(picture, frame, weights, kTestCamera);
  EXPECT_TRUE(is_red(at(picture, {303, 103})));
  EXPECT_TRUE(is_red(at(picture, {300, 100})));
}

TEST(FeatureOverlay, ColoursLinesByWeight) {
  TrackedFrame frame = frame_with({}, kTestCamera);
  for (const auto& [y, weight] : {std::pair(50.0, 1.0), std::pair(100.0, 0.5), std::pair(150.0, 0.0)}) {
    frame.lines.push_back({LineId{0}, {100, y}, {300, y}, weight});
  }
  cv::Mat picture = black();
  draw_features(picture, frame, {}, kTestCamera);
  EXPECT_TRUE(is_blue(at(picture, {200, 50})));
  EXPECT_TRUE(is_purple(at(picture, {200, 100})));
  EXPECT_TRUE(is_red(at(picture, {200, 150})));
}

TEST(FeatureOverlay, SaysWhatTheColoursMeanInOneCorner) {
  const cv::Vec3b plain(128, 128, 128);
  cv::Mat picture(480, 640, CV_8UC3, cv::Scalar::all(128));
  draw_features(picture, frame_with({}, kTestCamera), {}, kTestCamera);
  const cv::Rect corner(0, 400, 200, 80);
  int hidden = 0, elsewhere = 0;
  bool red = false, green = false, blue = false;
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      const cv::Vec3b c = picture.at<cv::Vec3b>(y, x);
      if (c == plain) continue;
      ++(corner.contains({x, y}) ? hidden : elsewhere);
      red |= is_red(c);
      green |= is_green(c);
      blue |= is_blue(c);
    }
  }
  EXPECT_TRUE(red && green && blue);
  EXPECT_EQ(elsewhere, 0) << "in the lower left corner";
  EXPECT_LT(hidden, 640 * 480 / 40) << "it must not hide much";
}

TEST(FeatureOverlay, LeavesTheLegendOutOfSmallPictures) {
  cv::Mat picture = cv::Mat::zeros(120, 160, CV_8UC3);
  draw_features(picture, frame_with({}, kTestCamera), {}, kTestCamera);
  EXPECT_EQ(cv::countNonZero(picture.reshape(1)), 0);
}

TEST(WeightColors, TakeWhatIsOutOfRangeForTheNearerEnd) {
  EXPECT_EQ(point_color(-1.0), point_color(0.0));
  EXPECT_EQ(point_color(2.0), point_color(1.0));
  EXPECT_EQ(line_color(-1.0), line_color(0.0));
  EXPECT_EQ(line_color(2.0), line_color(1.0));
}

TEST(FeatureOverlay, OfAFrameThatIsNoneLeavesThePictureAlone) {
  cv::Mat picture = black();
  draw_features(picture, TrackedFrame{}, {}, kTestCamera);
  EXPECT_EQ(cv::countNonZero(picture.reshape(1)), 0);
}

}  // namespace
}  // namespace ipl_slam
