#include "dense/cloud_renderer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

constexpr Rgb kRed{255, 0, 0}, kGreen{0, 255, 0}, kBlue{0, 0, 255};

// A square in the plane z = `depth` of the world, which faces the world's origin.
void add_square(SemanticCloud& cloud, float half, float depth, const Rgb& color,
                std::int32_t label = CloudPoint::kUnlabelled) {
  constexpr float kStep = 0.01F;
  const int n = static_cast<int>(std::lround(half / kStep));
  for (int y = -n; y <= n; ++y) {
    for (int x = -n; x <= n; ++x) {
      CloudPoint point;
      point.position = {kStep * static_cast<float>(x), kStep * static_cast<float>(y), depth};
      point.normal = -Eigen::Vector3f::UnitZ();
      point.color = color;
      point.label = label;
      cloud.points.push_back(point);
    }
  }
}

// From the world's origin along z.
Viewpoint plain_view() {
  Viewpoint view;
  view.size = {320, 240};
  view.scale = 200.0;
  return view;
}

PictureStyle unshaded() {
  PictureStyle style;
  style.shading = false;
  return style;
}

Rgb at(const cv::Mat& picture, int u, int v) {
  const auto& c = picture.at<cv::Vec3b>(v, u);
  return {c[2], c[1], c[0]};
}

cv::Mat draw(const SemanticCloud& cloud, const PictureStyle& style = unshaded(),
             const std::vector<PictureLine>& lines = {}, const Viewpoint& view = plain_view()) {
  return draw_cloud(cloud, view, {}, lines, style);
}

TEST(CloudRenderer, PutsASurfaceWhereThePinholeModelSays) {
  SemanticCloud cloud;
  add_square(cloud, 0.5F, 2.0F, kRed);
  const cv::Mat picture = draw(cloud);
  // 0.5 m at 2 m with 200 pixels per metre: 50 pixels to either side, half a point's square (1.3 x 10 mm)
  // more.
  int red = 0;
  for (int v = 0; v < picture.rows; ++v) {
    for (int u = 0; u < picture.cols; ++u) red += at(picture, u, v) == kRed ? 1 : 0;
  }
  EXPECT_NEAR(red, 101 * 101, 2 * 101 * 2) << "no gap inside, one pixel of doubt around";
  EXPECT_EQ(at(picture, 160 - 49, 120), kRed);
  EXPECT_EQ(at(picture, 160 - 53, 120), (Rgb{255, 255, 255}));
}

TEST(CloudRenderer, ShowsWhatIsNearer) {
  SemanticCloud cloud;
  add_square(cloud, 0.2F, 1.0F, kGreen);
  add_square(cloud, 1.0F, 2.0F, kRed);
  cv::Mat picture = draw(cloud);
  EXPECT_EQ(at(picture, 160, 120), kGreen);
  EXPECT_EQ(at(picture, 160 + 70, 120), kRed);
  std::reverse(cloud.points.begin(), cloud.points.end());
  EXPECT_EQ(cv::norm(draw(cloud), picture, cv::NORM_INF), 0.0) << "the order of the points does not matter";
}

TEST(CloudRenderer, LeavesOutWhatFacesAway) {
  SemanticCloud cloud;
  add_square(cloud, 0.5F, 2.0F, kRed);
  add_square(cloud, 0.5F, 1.0F, kBlue);
  for (std::size_t i = cloud.points.size() / 2; i < cloud.points.size(); ++i) cloud.points[i].normal *= -1.0F;
  EXPECT_EQ(at(draw(cloud), 160, 120), kRed);
  PictureStyle all = unshaded();
  all.all_faces = true;
  EXPECT_EQ(at(draw(cloud, all), 160, 120), kBlue);
  for (CloudPoint& point : cloud.points) point.normal.setZero();
  EXPECT_EQ(at(draw(cloud), 160, 120), kBlue) << "what has no normal faces no way";
}

TEST(CloudRenderer, ClosesSmallGapsButNotHoles) {
  SemanticCloud cloud;
  add_square(cloud, 0.3F, 1.0F, kGreen);
  std::erase_if(cloud.points, [](const CloudPoint& p) { return p.position.head<2>().norm() < 0.05F; });
  add_square(cloud, 2.0F, 3.0F, kRed);
  PictureStyle style = unshaded();
  style.point_size =
      0.0075;  // points are 2 pixels apart and 1.5 large: without closing, the red shines through
  const cv::Mat picture = draw(cloud, style);
  EXPECT_EQ(at(picture, 160, 120), kRed);
  for (int v = 120 - 55; v < 120 + 55; ++v) {
    for (int u = 160 - 55; u < 160 - 15; ++u) ASSERT_EQ(at(picture, u, v), kGreen) << u << " " << v;
  }
}

TEST(CloudRenderer, DrawsLinesOnlyWhereNothingIsBeforeThem) {
  SemanticCloud cloud;
  add_square(cloud, 0.2F, 1.0F, kRed);
  const PictureLine behind{{{-0.8, 0, 2}, {0.8, 0, 2}}, kBlue},
      before{{{-0.8, 0.1, 0.9}, {0.8, 0.1, 0.9}}, kGreen};
  const cv::Mat picture = draw(cloud, unshaded(), {behind, before});
  EXPECT_EQ(at(picture, 160, 120), kRed);
  EXPECT_EQ(at(picture, 160 + 60, 120), kBlue);
  EXPECT_EQ(at(picture, 160, 120 + 22), kGreen);
  // One that begins behind the eye is cut there.
  const PictureLine through{{{0.05, 0.3, -1}, {0.05, 0.3, 1}}, kBlue};
  EXPECT_EQ(at(draw(cloud, unshaded(), {through}), 160 + 10, 120 + 60), kBlue);
}

TEST(CloudRenderer, ColoursByWhatIsAskedFor) {
  SemanticCloud cloud;
  add_square(cloud, 0.3F, 1.0F, kGreen, 56);
  cloud.classes = {{56, "chair", kBlue}};
  const auto color_of = [&](PictureColors colors) {
    PictureStyle style = unshaded();
    style.colors = colors;
    return at(draw(cloud, style), 160, 120);
  };
  EXPECT_EQ(color_of(PictureColors::kImage), kGreen);
  EXPECT_EQ(color_of(PictureColors::kLabels), kBlue);
  EXPECT_EQ(color_of(PictureColors::kNormals), (Rgb{128, 128, 0}));
  const Rgb unsure = color_of(PictureColors::kConfidence);
  for (CloudPoint& point : cloud.points) point.confidence = 1.0F;
  const Rgb sure = color_of(PictureColors::kConfidence);
  EXPECT_GT(sure[0] + sure[1] + sure[2], unsure[0] + unsure[1] + unsure[2]);
  for (CloudPoint& point : cloud.points) point.label = CloudPoint::kUnlabelled;
  const Rgb grey = color_of(PictureColors::kLabels);
  EXPECT_TRUE(grey[0] == grey[1] && grey[1] == grey[2]);

  PictureStyle height = unshaded();
  height.colors = PictureColors::kHeight;
  Upright upright;
  upright.T_uw = SE3(Eigen::Quaterniond(Eigen::AngleAxisd(-std::numbers::pi / 2, Eigen::Vector3d::UnitX())),
                     Eigen::Vector3d::Zero());
  const cv::Mat picture = draw_cloud(cloud, plain_view(), upright, {}, height);
  const Rgb high = at(picture, 160, 120 - 55), low = at(picture, 160, 120 + 55);
  EXPECT_NE(high, low);
}

TEST(CloudRenderer, ShowsALegendOfTheClassesInThePicture) {
  SemanticCloud cloud;
  add_square(cloud, 0.1F, 1.0F, kRed, 3);
  add_square(cloud, 0.1F, -1.0F, kRed, 4);  // behind the eye
  cloud.classes = {{3, "car", kGreen}, {4, "bus", kBlue}};
  PictureStyle style = unshaded();
  style.background = {0, 0, 0};
  style.colors = PictureColors::kLabels;
  const cv::Mat picture = draw(cloud, style);
  int green = 0, blue = 0, white = 0;
  for (int v = 0; v < 60; ++v) {
    for (int u = 0; u < 100; ++u) {
      green += at(picture, u, v) == kGreen ? 1 : 0;
      blue += at(picture, u, v) == kBlue ? 1 : 0;
      white += at(picture, u, v) == Rgb{255, 255, 255} ? 1 : 0;
    }
  }
  EXPECT_EQ(green, 14 * 14) << "the patch beside the name";
  EXPECT_EQ(blue, 0) << "not in the picture";
  EXPECT_GT(white, 500);
  style.colors = PictureColors::kImage;
  EXPECT_EQ(at(draw(cloud, style), 12, 12), (Rgb{0, 0, 0})) << "no legend";
}

TEST(CloudRenderer, DrawsFarAwayAndDegenerateCloudsWithoutFuss) {
  SemanticCloud cloud;
  EXPECT_EQ(at(draw(cloud), 160, 120), (Rgb{255, 255, 255}));
  EXPECT_EQ(point_spacing(cloud), 0.0);
  CloudPoint point;
  point.position = {0, 0, 1};
  point.color = kRed;
  cloud.points = {point};
  EXPECT_EQ(point_spacing(cloud), 0.0);
  (void)draw(cloud);
  for (const float far : {1e10F, 1e30F, 3e38F}) {
    point.position = {far, -far, far};
    cloud.points.push_back(point);
    point.position = {-far, far, 0.06F};
    cloud.points.push_back(point);
  }
  const PictureLine line{{{-1e30, 0, 1}, {1e30, 0, 1}}, kBlue};
  (void)draw(cloud, unshaded(), {line});
}

TEST(PointSpacing, IsThatOfALattice) {
  SemanticCloud cloud;
  add_square(cloud, 0.5F, 1.0F, kRed);
  EXPECT_NEAR(point_spacing(cloud), 0.01, 1e-4);
}

}  // namespace
}  // namespace ipl_slam
