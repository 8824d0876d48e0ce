#include "pipeline/feature_overlay.hpp"

#include <gtest/gtest.h>

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
  draw_features(picture, frame, camera);
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
  draw_features(picture, frame, kTestCamera);
  EXPECT_TRUE(is_green(at(picture, {100, 100})));
}

TEST(FeatureOverlay, DrawsLinesInBlue) {
  TrackedFrame frame = frame_with({}, kTestCamera);
  frame.lines.push_back({LineId{3}, {100, 200}, {300, 260}});
  cv::Mat picture = black();
  draw_features(picture, frame, kTestCamera);
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
  draw_features(picture, frame, camera);
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
  draw_features(picture, frame, kTestCamera);
  EXPECT_TRUE(is_blue(at(picture, {320, 100})));
}

TEST(FeatureOverlay, OfAFrameThatIsNoneLeavesThePictureAlone) {
  cv::Mat picture = black();
  draw_features(picture, TrackedFrame{}, kTestCamera);
  EXPECT_EQ(cv::countNonZero(picture.reshape(1)), 0);
}

}  // namespace
}  // namespace ipl_slam
