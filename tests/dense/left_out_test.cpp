#include "dense/left_out.hpp"

#include <stdexcept>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace ipl_slam {
namespace {

constexpr std::uint16_t kWall = 15000, kBody = 8000;  // 3.0 and 1.6 m

/// A person before a wall, of whom the mask lacks an arm and the head's top; 640 x 480.
struct Scene {
  Scene() {
    depth = cv::Mat(480, 640, CV_16UC1, cv::Scalar(kWall));
    labels = cv::Mat::zeros(480, 640, CV_8UC1);
    depth(trunk) = kBody;
    depth(arm) = kBody + 100;
    labels(trunk) = 1;
  }
  // A floor from below the feet, in row 420, to the wall, as a level camera 0.55 m above it sees it.
  void lay_floor() {
    for (int y = 340; y < 480; ++y) {
      const double z = 0.55 * camera.fy / (y - camera.cy);
      depth.row(y).setTo(std::min<double>(kWall, z * camera.depth_scale), labels.row(y) == 0);
    }
  }
  [[nodiscard]] cv::Mat mask(const LeftOutOptions& options = {}) const {
    return left_out_mask(labels, depth, instances, moved, camera, options);
  }

  Camera camera;
  cv::Rect trunk{280, 120, 80, 300}, arm{360, 200, 60, 20};
  cv::Mat depth, labels;
  std::vector<ViewInstance> instances{{InstanceId{3}, "person", 0.9F}};
  std::set<InstanceId> moved;
};

double share(const cv::Mat& mask, const cv::Rect& box) {
  return cv::countNonZero(mask(box)) / static_cast<double>(box.area());
}

TEST(LeftOut, AreMoversByClassAndWhatMoved) {
  const ViewInstance person{InstanceId{1}, "person", 0.5F}, chair{InstanceId{2}, "chair", 0.5F};
  const std::set<InstanceId> moved{InstanceId{2}};
  LeftOutOptions options;
  EXPECT_TRUE(is_left_out(person, {}, options));
  EXPECT_FALSE(is_left_out(chair, {}, options));
  EXPECT_TRUE(is_left_out(chair, moved, options));
  options.movers = options.moved = false;
  EXPECT_FALSE(is_left_out(person, {}, options));
  EXPECT_FALSE(is_left_out(chair, moved, options));
  EXPECT_FALSE(is_left_out({InstanceId{}, "chair", 0.5F}, {}, LeftOutOptions{})) << "an instance without id";
}

TEST(LeftOut, IsNothingWithoutAnybody) {
  Scene scene;
  scene.instances[0].class_name = "chair";
  EXPECT_EQ(cv::countNonZero(scene.mask()), 0);
  scene.moved = {InstanceId{3}};
  EXPECT_GT(cv::countNonZero(scene.mask()), 0) << "the chair moved";
}

TEST(LeftOut, GrowsByADiscInScaleWithTheImage) {
  Scene scene;
  const LeftOutOptions options{.grow = 10, .reach = 0};
  const cv::Mat mask = scene.mask(options);
  EXPECT_EQ(mask.at<std::uint8_t>(300, 280 - 10), 255);
  EXPECT_EQ(mask.at<std::uint8_t>(300, 280 - 11), 0);
  EXPECT_EQ(mask.at<std::uint8_t>(120 - 8, 280 - 8), 0) << "a disc, not a square";

  cv::resize(scene.labels, scene.labels, {320, 240}, 0, 0, cv::INTER_NEAREST);
  cv::resize(scene.depth, scene.depth, {320, 240}, 0, 0, cv::INTER_NEAREST);
  const cv::Mat half = scene.mask(options);
  EXPECT_EQ(half.at<std::uint8_t>(150, 140 - 5), 255);
  EXPECT_EQ(half.at<std::uint8_t>(150, 140 - 6), 0);
}

TEST(LeftOut, TakesAnArmThatTheMaskLacksAndLeavesTheWall) {
  const Scene scene;
  const cv::Mat mask = scene.mask();
  EXPECT_EQ(share(mask, scene.arm), 1.0);
  EXPECT_EQ(share(mask, {0, 0, 640, 110}), 0.0) << "the wall above";
  EXPECT_EQ(share(mask, {380, 240, 100, 200}), 0.0) << "the wall beside";
  EXPECT_LT(share(scene.mask({.reach = 0}), scene.arm), 0.2) << "growth alone does not reach it";
}

TEST(LeftOut, LeavesTheFloorUnderTheFeet) {
  Scene scene;
  scene.lay_floor();
  const cv::Mat with = scene.mask(), without = scene.mask({.reach = 0});
  const cv::Rect floor(200, 340, 240, 140);
  EXPECT_NEAR(share(with, floor), share(without, floor), 0.01);
  EXPECT_EQ(share(with, scene.arm), 1.0) << "while the arm goes";
}

TEST(LeftOut, LeavesTheWallSomebodyLeansOn) {
  Scene scene;
  for (const cv::Rect& part : {scene.trunk, scene.arm}) scene.depth(part) = kWall - 150;  // 3 cm in front
  EXPECT_LT(share(scene.mask(), {0, 0, 640, 480}), share(scene.mask({.reach = 0}), {0, 0, 640, 480}) + 0.01);
}

TEST(LeftOut, LeavesThingsBehindAMaskThatSpillsOverThem) {
  Scene scene;
  // A monitor behind the person, well in front of the wall; the mask holds a strip of it.
  const cv::Rect monitor(360, 100, 70, 90);
  scene.depth(monitor) = 11000;
  scene.labels(cv::Rect(360, 100, 6, 90)) = 1;
  const cv::Mat mask = scene.mask();
  EXPECT_EQ(share(mask, {380, 100, 50, 80}), 0.0);
  EXPECT_EQ(share(mask, scene.arm), 1.0);
}

TEST(LeftOut, ReachesToTheBordersOfTheImage) {
  Scene scene;
  scene.trunk = {560, 120, 60, 300};
  scene.arm = {620, 200, 20, 40};
  scene.depth = kWall;
  scene.labels = 0;
  scene.depth(scene.trunk) = kBody;
  scene.depth(scene.arm) = kBody;
  scene.labels(scene.trunk) = 1;
  EXPECT_EQ(share(scene.mask(), scene.arm), 1.0);
}

TEST(LeftOut, NeedsNoDepth) {
  Scene scene;
  scene.depth = 0;
  EXPECT_EQ(cv::norm(scene.mask(), scene.mask({.reach = 0}), cv::NORM_INF), 0.0);
}

TEST(LeftOut, RefusesImagesThatDoNotFit) {
  Scene scene;
  scene.depth = scene.depth(cv::Rect(0, 0, 320, 240));
  EXPECT_THROW((void)scene.mask(), std::invalid_argument);
}

}  // namespace
}  // namespace ipl_slam
