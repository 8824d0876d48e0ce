#include "dense/cloud_painter.hpp"

#include <algorithm>
#include <functional>
#include <stdexcept>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "dense/analytic_grid.hpp"

namespace ipl_slam {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr std::int32_t kChair = 56, kCup = 41;

Camera small_camera() {
  Camera camera;
  camera.width = 160;
  camera.height = 120;
  camera.fx = camera.fy = 130.0;
  camera.cx = 79.5;
  camera.cy = 59.5;
  return camera;
}

// A wall at z = 1 m, 0.8 m wide and high, that a camera at the origin looks at.
std::vector<SurfacePoint> wall() {
  VoxelGrid grid(kVoxel);
  fill(grid, {-40, -40, 94}, {39, 39, 105}, plane({0, 0, -1}, -1.002));
  return extract_surface(grid, kTruncation, {});
}

struct View {
  cv::Mat color{120, 160, CV_8UC3, cv::Scalar(30, 20, 10)};
  cv::Mat depth{120, 160, CV_32FC1, cv::Scalar(1.002F)};
  cv::Mat labels{120, 160, CV_8UC1, cv::Scalar(0)};
  std::vector<ViewInstance> instances;

  // Draws an instance.
  void add(std::uint32_t id, const std::string& name, const cv::Rect& box, float score = 0.8F) {
    instances.push_back({InstanceId{id}, name, score});
    labels(box).setTo(static_cast<double>(instances.size()));
  }
  [[nodiscard]] PaintView paint() const { return {color, depth, labels, instances}; }
};

// 3 pixels of these images count as the margin.
PaintOptions with_margin() {
  PaintOptions options;
  options.margin = 12;  // of 640
  return options;
}

CloudPainter painter_of(std::vector<SurfacePoint> points, const std::vector<View>& views,
                        const PaintOptions& options = with_margin()) {
  CloudPainter painter(std::move(points), small_camera(), options);
  for (const View& view : views) painter.add(view.paint(), {});
  return painter;
}

std::vector<CloudPoint> with_label(const SemanticCloud& cloud, std::int32_t label) {
  std::vector<CloudPoint> points;
  std::copy_if(cloud.points.begin(), cloud.points.end(), std::back_inserter(points),
               [&](const CloudPoint& p) { return p.label == label; });
  return points;
}

// The pixel of the camera at the origin that sees a point.
cv::Point pixel_of(const Vector3f& p) {
  const Eigen::Vector2d uv = small_camera().project(p.cast<double>());
  return {static_cast<int>(std::lround(uv.x())), static_cast<int>(std::lround(uv.y()))};
}

TEST(CloudPainter, GivesPointsTheColourOfTheirPixel) {
  View view;
  for (int v = 0; v < 120; ++v) {
    for (int u = 0; u < 160; ++u) {
      view.color.at<cv::Vec3b>(v, u) = {static_cast<std::uint8_t>(u), static_cast<std::uint8_t>(v), 77};
    }
  }
  const SemanticCloud cloud = painter_of(wall(), {view, view}).cloud();
  EXPECT_EQ(cloud.points.size(), 80U * 80U);
  EXPECT_TRUE(cloud.classes.empty());
  for (const CloudPoint& p : cloud.points) {
    const cv::Point at = pixel_of(p.position);
    EXPECT_EQ(p.color, (Rgb{77, static_cast<std::uint8_t>(at.y), static_cast<std::uint8_t>(at.x)}));
    EXPECT_EQ(p.label, CloudPoint::kUnlabelled);
    EXPECT_EQ(p.confidence, 0.0F);
  }
}

TEST(CloudPainter, LetsNearViewsDominate) {
  View near, far;
  far.color.setTo(cv::Scalar(230, 220, 210));
  far.depth.setTo(3.002F);
  CloudPainter painter(wall(), small_camera(), {});
  painter.add(near.paint(), {});
  painter.add(far.paint(), SE3(Eigen::Quaterniond::Identity(), Vector3d(0, 0, 2)));
  // In the middle of the wall the weights are 64 and 64 / 9: (10 x 63 + 210 x 7) / 70.
  for (const CloudPoint& p : painter.cloud().points) {
    if (p.position.head<2>().norm() < 0.05F) {
      EXPECT_NEAR(p.color[0], 30, 1);
    }
  }
}

TEST(CloudPainter, TakesNothingFromViewsInWhichAPointIsHiddenOrTurnedAway) {
  View hidden, unknown, good, beyond;
  hidden.color.setTo(cv::Scalar(0, 0, 255));
  unknown.color = beyond.color = hidden.color;
  hidden.depth.setTo(0.95F);
  unknown.depth.setTo(0.0F);
  beyond.depth.setTo(1.05F);
  const SemanticCloud cloud = painter_of(wall(), {hidden, good, unknown, beyond}).cloud();
  ASSERT_EQ(cloud.points.size(), 80U * 80U);
  for (const CloudPoint& p : cloud.points) EXPECT_EQ(p.color, (Rgb{10, 20, 30}));
  EXPECT_TRUE(painter_of(wall(), {hidden, unknown}).cloud().points.empty());

  CloudPainter painter(wall(), small_camera(), {});  // from behind the wall
  painter.add(good.paint(), SE3(Eigen::Quaterniond(0, 0, 1, 0), Vector3d(0, 0, 2.004)));
  EXPECT_TRUE(painter.cloud().points.empty());
}

TEST(CloudPainter, SeesFromAnywhereWhatLiesInThePicture) {
  // Blocks are left out as a whole if they cannot be seen: the same points must remain as pixel by pixel.
  const std::vector<SurfacePoint> points = wall();
  Vector6d twist;
  for (int k = 0; k < 8; ++k) {
    twist << 0.2 * std::sin(k), 0.15 * std::cos(2 * k), 0.3, 0.3 * std::cos(k), 0.4 * std::sin(3 * k),
        0.5 * k;
    const SE3 T_cw = SE3::exp(twist);
    View view;
    std::size_t expected = 0;
    view.depth.setTo(0.0F);
    for (const SurfacePoint& point : points) {
      const Vector3d p_c = T_cw * point.position.cast<double>();
      const Eigen::Vector2d uv = small_camera().project(p_c);
      const cv::Point at(static_cast<int>(std::floor(uv.x() + 0.5)),
                         static_cast<int>(std::floor(uv.y() + 0.5)));
      if (at.inside({0, 0, 160, 120})) view.depth.at<float>(at) = static_cast<float>(p_c.z());
    }
    for (const SurfacePoint& point : points) {
      const Vector3d p_c = T_cw * point.position.cast<double>();
      const Eigen::Vector2d uv = small_camera().project(p_c);
      const cv::Point at(static_cast<int>(std::floor(uv.x() + 0.5)),
                         static_cast<int>(std::floor(uv.y() + 0.5)));
      if (at.inside({0, 0, 160, 120}) && std::abs(view.depth.at<float>(at) - p_c.z()) < 0.02) ++expected;
    }
    CloudPainter painter(points, small_camera(), {});
    painter.add(view.paint(), T_cw);
    EXPECT_GT(expected, 500U);
    // Points on the border between two pixels may go to the other one in single precision.
    EXPECT_NEAR(static_cast<double>(painter.cloud().points.size()), static_cast<double>(expected), 3.0);
  }
}

TEST(CloudPainter, RefusesImagesThatDoNotFit) {
  CloudPainter painter(wall(), small_camera(), {});
  View view;
  view.depth = cv::Mat(60, 80, CV_32FC1, cv::Scalar(1.0F));
  EXPECT_THROW(painter.add(view.paint(), {}), std::invalid_argument);
}

TEST(CloudPainter, NamesPointsInsideTheMasksOnly) {
  View view;
  const cv::Rect box(60, 40, 40, 40);
  view.add(7, "chair", box);
  const SemanticCloud cloud = painter_of(wall(), {view, view}).cloud();
  const cv::Rect inner(box.x + 3, box.y + 3, box.width - 6, box.height - 6);
  for (const CloudPoint& p : cloud.points) {
    EXPECT_EQ(p.label == kChair, inner.contains(pixel_of(p.position)));
    if (p.label == kChair) {
      EXPECT_NEAR(p.confidence, 0.8F, 1.0F / 256);
    }
  }
  ASSERT_EQ(cloud.classes.size(), 1U);
  EXPECT_EQ(cloud.classes[0], (CloudClass{kChair, "chair", class_color(kChair)}));
}

TEST(CloudPainter, NeedsTwoViewsForAName) {
  View named, unnamed;
  named.add(7, "chair", {60, 40, 40, 40});
  EXPECT_TRUE(with_label(painter_of(wall(), {named, unnamed}).cloud(), kChair).empty());
  EXPECT_FALSE(with_label(painter_of(wall(), {named, unnamed, named}).cloud(), kChair).empty());
}

TEST(CloudPainter, TakesUnknownForNoName) {
  View view;
  view.add(7, "unknown", {60, 40, 40, 40});
  const CloudPainter painter = painter_of(wall(), {view, view, view});
  EXPECT_TRUE(painter.cloud().classes.empty());
  EXPECT_TRUE(painter.objects().empty());
}

TEST(CloudPainter, WeighsMissesAgainstNames) {
  View named, missed;
  named.add(7, "chair", {60, 40, 40, 40}, 0.75F);
  std::vector<View> views{named, named};
  for (int i = 0; i < 10; ++i) views.push_back(missed);
  // 1.5 of votes against 10 x 0.15.
  const auto points = with_label(painter_of(wall(), views).cloud(), kChair);
  ASSERT_FALSE(points.empty());
  EXPECT_NEAR(points[0].confidence, 1.5 / (2 + 1.5), 1e-6);
  for (int i = 0; i < 6; ++i) views.push_back(missed);  // 1.5 / (1.5 + 2.4) < 0.4
  EXPECT_TRUE(with_label(painter_of(wall(), views).cloud(), kChair).empty());
}

TEST(CloudPainter, GoesWithTheClassOfTheBestScores) {
  View chair, cup;
  chair.add(7, "chair", {60, 40, 40, 40}, 0.875F);
  cup.add(7, "cup", {60, 40, 40, 40}, 0.25F);
  const SemanticCloud cloud = painter_of(wall(), {cup, chair, cup, chair, cup}).cloud();
  EXPECT_TRUE(with_label(cloud, kCup).empty());
  const auto points = with_label(cloud, kChair);
  ASSERT_FALSE(points.empty());
  EXPECT_NEAR(points[0].confidence, 1.75 / 5, 1e-6);  // mean over all five, 0 where it was called a cup
}

TEST(CloudPainter, DoesNotNameWhatIsSeenThroughAnInstance) {
  // The mask of a thing at 1 m holds a part of the wall at 2 m.
  VoxelGrid grid(kVoxel);
  fill(grid, {-20, -20, 94}, {9, 19, 105}, plane({0, 0, -1}, -1.002));
  fill(grid, {-40, -40, 194}, {79, 39, 205}, plane({0, 0, -1}, -2.002));
  View view;
  view.depth.setTo(2.002F);
  view.depth(cv::Rect(53, 33, 39, 53)).setTo(1.002F);
  view.add(7, "chair", {53, 33, 54, 53});
  const SemanticCloud cloud = painter_of(extract_surface(grid, kTruncation, {}), {view, view}).cloud();
  const auto points = with_label(cloud, kChair);
  EXPECT_GT(points.size(), 400U);
  for (const CloudPoint& p : points) EXPECT_LT(p.position.z(), 1.1F);
}

TEST(CloudObjects, AreOneWhereTracksLieOnEachOther) {
  View first, second;
  first.add(3, "chair", {20, 30, 40, 60}, 0.5F);
  second.add(9, "chair", {22, 30, 40, 60}, 0.5F);  // the same, after it was lost
  for (View* view : {&first, &second}) view->add(4, "chair", {90, 40, 30, 30}, 0.75F);
  first.add(5, "cup", {64, 40, 22, 40});  // in three views
  const auto objects = painter_of(wall(), {first, second, first, first}).objects();
  ASSERT_EQ(objects.size(), 3U);
  EXPECT_EQ(objects[0].class_name, "cup");
  EXPECT_EQ(objects[0].views, 3);
  EXPECT_EQ(objects[1].class_name, "chair");
  EXPECT_EQ(objects[1].views, 4);
  EXPECT_EQ(objects[2].views, 4);
  EXPECT_GT(objects[1].points, objects[2].points);
  EXPECT_NEAR(objects[2].confidence, 0.75F, 1e-6F);
  // Pixels 93 to 116 and 43 to 66, at a depth of 1 m.
  EXPECT_NEAR(objects[2].low.x(), (93 - 79.5) / 130, 0.015);
  EXPECT_NEAR(objects[2].high.x(), (116 - 79.5) / 130, 0.015);
  EXPECT_NEAR(objects[2].low.y(), (43 - 59.5) / 130, 0.015);
  EXPECT_NEAR(objects[2].high.y(), (66 - 59.5) / 130, 0.015);
  EXPECT_NEAR(objects[2].centre.x(), (104.5 - 79.5) / 130, 0.01);
  EXPECT_NEAR(objects[2].centre.z(), 1.002, 1e-3);
}

TEST(CloudObjects, OfFewPointsOrOneViewAreNone) {
  View view;
  view.add(3, "chair", {20, 30, 14, 14});  // 8 x 8 pixels inside, of 0.6 points each
  EXPECT_TRUE(painter_of(wall(), {view, view}).objects().empty());
  View large;
  large.add(4, "chair", {60, 40, 40, 40});
  EXPECT_TRUE(painter_of(wall(), {large}).objects().empty());
  EXPECT_EQ(painter_of(wall(), {large, large}).objects().size(), 1U);
}

TEST(CloudPainter, DoesNotDependOnTheOrderOfViews) {
  std::vector<View> views(5);
  for (int i = 0; i < 5; ++i) {
    View& view = views[static_cast<std::size_t>(i)];
    cv::randu(view.color, 0, 255);
    view.add(static_cast<std::uint32_t>(10 - i), i % 2 == 0 ? "chair" : "cup", {40 + 4 * i, 40, 50, 40},
             0.3F + 0.1F * static_cast<float>(i));
  }
  const CloudPainter a = painter_of(wall(), views);
  std::reverse(views.begin(), views.end());
  const CloudPainter b = painter_of(wall(), views);
  EXPECT_EQ(a.cloud().points, b.cloud().points);
  const auto x = a.objects(), y = b.objects();
  ASSERT_EQ(x.size(), y.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    EXPECT_EQ(x[i].points, y[i].points);
    EXPECT_EQ(x[i].low, y[i].low);
    EXPECT_EQ(x[i].views, y[i].views);
  }
}

}  // namespace
}  // namespace ipl_slam
