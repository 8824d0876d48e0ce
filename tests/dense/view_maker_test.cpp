#include "dense/view_maker.hpp"

#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

#include "dataset/camera_config.hpp"

namespace ipl_slam {
namespace {

Camera small_camera() {
  Camera camera;
  camera.width = 64;
  camera.height = 48;
  camera.fx = camera.fy = 60.0;
  camera.cx = 31.5;
  camera.cy = 23.5;
  return camera;
}

TrackedInstance instance(unsigned id, const char* class_name, float score, const cv::Rect& box,
                         cv::Size size = {64, 48}) {
  TrackedInstance tracked;
  tracked.id = InstanceId{id};
  tracked.instance = {class_name, score, box, BitMask(size)};
  for (int y = box.y; y < box.br().y; ++y) tracked.instance.mask.set_run(y, box.x, box.br().x);
  return tracked;
}

struct Images {
  explicit Images(cv::Size size = {64, 48})
      : color(size, CV_8UC3, cv::Scalar(10, 20, 30)), depth(size, CV_16UC1, cv::Scalar(5000)) {}
  cv::Mat color, depth;
};

std::string name_at(const DenseView& view, int x, int y) {
  const int label = view.labels.at<std::uint8_t>(y, x);
  return label == 0 ? "" : view.instances[static_cast<std::size_t>(label) - 1].class_name;
}

TEST(ViewMaker, SharesThePixelsOfACameraWithoutDistortion) {
  const Images images;
  const DenseView view = ViewMaker(small_camera()).make(1.5, images.color, images.depth, {});
  EXPECT_EQ(view.timestamp, 1.5);
  EXPECT_EQ(view.color.data, images.color.data);
  EXPECT_EQ(view.depth.data, images.depth.data);
  EXPECT_EQ(cv::countNonZero(view.labels), 0);
  EXPECT_TRUE(view.instances.empty());
}

TEST(ViewMaker, MakesGreyImagesBgrAndLeavesThemAsTheyAre) {
  const Images images;
  const cv::Mat grey(images.color.size(), CV_8UC1, cv::Scalar(77));
  const DenseView view = ViewMaker(small_camera()).make(0.0, grey, images.depth, {});
  ASSERT_EQ(view.color.type(), CV_8UC3);
  EXPECT_EQ(view.color.at<cv::Vec3b>(20, 30), cv::Vec3b(77, 77, 77));
  EXPECT_EQ(grey.channels(), 1);
}

TEST(ViewMaker, DrawsMoversOverThingsAndTheSurerOverTheLessSure) {
  const Images images;
  const DenseView view =
      ViewMaker(small_camera())
          .make(0.0, images.color, images.depth,
                {instance(0, "chair", 0.9F, {0, 0, 20, 20}), instance(1, "person", 0.3F, {10, 0, 20, 20}),
                 instance(2, "cup", 0.5F, {0, 10, 64, 20}), instance(3, "dog", 0.4F, {25, 0, 10, 20})});
  EXPECT_EQ(name_at(view, 5, 5), "chair");
  EXPECT_EQ(name_at(view, 15, 5), "person") << "a mover, however unsure";
  EXPECT_EQ(name_at(view, 5, 15), "chair") << "surer than the cup";
  EXPECT_EQ(name_at(view, 63, 29), "cup");
  EXPECT_EQ(name_at(view, 27, 5), "dog") << "of two movers the surer one";
  EXPECT_EQ(name_at(view, 40, 5), "");
}

TEST(ViewMaker, KeepsThe255BestOfMore) {
  const Images images;
  std::vector<TrackedInstance> instances;
  for (unsigned i = 0; i < 300; ++i) {
    const int x = static_cast<int>(i % 60), y = static_cast<int>(i / 60);
    instances.push_back(instance(i, "book", 0.001F * static_cast<float>(i), {x, y, 1, 1}));
  }
  const DenseView view = ViewMaker(small_camera()).make(0.0, images.color, images.depth, instances);
  ASSERT_EQ(view.instances.size(), 255U);
  EXPECT_EQ(name_at(view, 299 % 60, 299 / 60), "book");
  EXPECT_EQ(name_at(view, 44, 0), "") << "the 45 least sure are left out";
  EXPECT_EQ(name_at(view, 45, 0), "book");
}

TEST(ViewMaker, BendsEverythingToThePinholeCamera) {
  const Camera camera = load_camera("tum1");
  const cv::Size size(camera.width, camera.height);
  Images images(size);
  // Depth tells where a pixel came from: its column on the left half of the depths, its row in the colour.
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      images.depth.at<std::uint16_t>(y, x) = static_cast<std::uint16_t>(1000 + x);
      images.color.at<cv::Vec3b>(y, x) = cv::Vec3b::all(static_cast<std::uint8_t>(y / 2));
    }
  }
  const cv::Rect box(50, 40, 100, 80);
  const cv::Mat depth_before = images.depth.clone();
  const DenseView view =
      ViewMaker(camera).make(0.0, images.color, images.depth, {instance(4, "person", 0.8F, box, size)});
  EXPECT_EQ(cv::norm(images.depth, depth_before, cv::NORM_INF), 0.0) << "input is not written to";
  double largest_shift = 0.0;
  for (int y = 0; y < size.height; y += 7) {
    for (int x = 0; x < size.width; x += 7) {
      const Eigen::Vector2d source = camera.distort({x, y});
      largest_shift = std::max(largest_shift, (source - Eigen::Vector2d(x, y)).norm());
      const int u = static_cast<int>(std::lround(source.x())), v = static_cast<int>(std::lround(source.y()));
      if (u < 1 || v < 1 || u >= size.width - 1 || v >= size.height - 1) continue;
      // The maps know 1/32 pixel, so a source on the border of two pixels may be either.
      EXPECT_NEAR(view.depth.at<std::uint16_t>(y, x), 1000 + source.x(), 0.54);
      EXPECT_NEAR(view.color.at<cv::Vec3b>(y, x)[0], source.y() / 2, 1.1) << "interpolated, rounded";
      if (std::abs(source.x() - box.x) < 1 || std::abs(source.x() - box.br().x) < 1) continue;
      if (std::abs(source.y() - box.y) < 1 || std::abs(source.y() - box.br().y) < 1) continue;
      EXPECT_EQ(name_at(view, x, y) == "person", box.contains(cv::Point(u, v)));
    }
  }
  EXPECT_GT(largest_shift, 5.0) << "this lens bends";
}

TEST(ViewMaker, HasNoDepthWhereTheCameraSawNothing) {
  Camera camera = small_camera();
  camera.k1 = 0.5;  // the corners of the pinhole image lie outside the camera's
  const Images images;
  const DenseView view = ViewMaker(camera).make(0.0, images.color, images.depth, {});
  EXPECT_EQ(view.depth.at<std::uint16_t>(0, 0), 0);
  EXPECT_EQ(view.depth.at<std::uint16_t>(24, 32), 5000);
}

TEST(ViewMaker, RefusesImagesOfAnotherSize) {
  const ViewMaker maker(small_camera());
  const Images good, small({32, 24});
  EXPECT_THROW((void)maker.make(0.0, small.color, good.depth, {}), std::invalid_argument);
  EXPECT_THROW((void)maker.make(0.0, good.color, small.depth, {}), std::invalid_argument);
  EXPECT_THROW(
      (void)maker.make(0.0, good.color, good.depth, {instance(0, "cup", 1.0F, {0, 0, 2, 2}, {32, 24})}),
      std::invalid_argument);
}

TEST(Pinhole, IsTheCameraWithoutItsDistortion) {
  const Camera camera = load_camera("tum1"), straight = pinhole(camera);
  EXPECT_FALSE(straight.distorted());
  EXPECT_EQ(straight.fx, camera.fx);
  EXPECT_EQ(straight.cy, camera.cy);
  EXPECT_EQ(straight.depth_scale, camera.depth_scale);
}

}  // namespace
}  // namespace ipl_slam
