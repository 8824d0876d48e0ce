#include "segmentation/letterbox.hpp"

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

float value(const std::vector<float>& planes, cv::Size size, int plane, int x, int y) {
  return planes[static_cast<std::size_t>((plane * size.height + y) * size.width + x)];
}

TEST(Letterbox, PadsAboveAndBelowAWideImage) {
  const Letterbox letterbox({640, 480}, {640, 640});
  EXPECT_EQ(letterbox.content, cv::Rect(0, 80, 640, 480));
}

TEST(Letterbox, PadsLeftAndRightOfATallImage) {
  const Letterbox letterbox({480, 640}, {640, 640});
  EXPECT_EQ(letterbox.content, cv::Rect(80, 0, 480, 640));
}

TEST(Letterbox, GivesTheOddPixelToTheRightAndBottom) {
  // 100 x 51 leaves 13 rows of 64, half of which is 6.5; LetterBox rounds 6.4 and 6.6.
  EXPECT_EQ(Letterbox({100, 51}, {100, 64}).content, cv::Rect(0, 6, 100, 51));
  EXPECT_EQ(Letterbox({51, 100}, {64, 100}).content, cv::Rect(6, 0, 51, 100));
}

TEST(Letterbox, ScalesNoFurtherUpThanAllowed) {
  EXPECT_EQ(Letterbox({640, 480}, {640, 640}, 0.5).content, cv::Rect(160, 200, 320, 240));
  EXPECT_EQ(Letterbox({640, 480}, {320, 320}, 1.0).content, cv::Rect(0, 40, 320, 240));
}

TEST(Letterbox, TakesPointsThereAndBack) {
  for (const cv::Size image :
       {cv::Size(640, 480), cv::Size(1280, 720), cv::Size(319, 241), cv::Size(100, 400)}) {
    for (const cv::Size input : {cv::Size(640, 640), cv::Size(320, 256), cv::Size(96, 160)}) {
      const Letterbox letterbox(image, input);
      for (const cv::Point2d point :
           {cv::Point2d(0, 0), cv::Point2d(12.25, 77.5), cv::Point2d(image.width, image.height)}) {
        const cv::Point2d back = letterbox.to_image(letterbox.to_input(point));
        EXPECT_NEAR(back.x, point.x, 1e-9);
        EXPECT_NEAR(back.y, point.y, 1e-9);
      }
      // The image's corners are the content's corners.
      EXPECT_NEAR(letterbox.to_input({0, 0}).x, letterbox.content.x, 1e-9);
      EXPECT_NEAR(letterbox.to_input(cv::Point2d(image.width, image.height)).y, letterbox.content.br().y,
                  1e-9);
    }
  }
}

TEST(FillLetterbox, WritesRgbPlanesFromZeroToOneInGreyPadding) {
  const cv::Mat image(2, 4, CV_8UC3, cv::Scalar(0, 51, 255));  // B, G, R
  const cv::Size input(4, 4);
  std::vector<float> planes;
  fill_letterbox(image, Letterbox(image.size(), input), planes);
  ASSERT_EQ(planes.size(), 3U * 16U);
  for (int x = 0; x < 4; ++x) {
    for (int y : {1, 2}) {
      EXPECT_FLOAT_EQ(value(planes, input, 0, x, y), 1.0F);
      EXPECT_FLOAT_EQ(value(planes, input, 1, x, y), 0.2F);
      EXPECT_FLOAT_EQ(value(planes, input, 2, x, y), 0.0F);
    }
    for (int y : {0, 3}) {
      for (int plane : {0, 1, 2}) EXPECT_FLOAT_EQ(value(planes, input, plane, x, y), 114.0F / 255.0F);
    }
  }
}

TEST(FillLetterbox, GivesGreyImagesThreeEqualPlanes) {
  cv::Mat image(4, 4, CV_8UC1, cv::Scalar(51));
  image.at<std::uint8_t>(1, 2) = 255;
  std::vector<float> planes;
  fill_letterbox(image, Letterbox(image.size(), image.size()), planes);
  for (int plane : {0, 1, 2}) {
    EXPECT_FLOAT_EQ(value(planes, image.size(), plane, 2, 1), 1.0F);
    EXPECT_FLOAT_EQ(value(planes, image.size(), plane, 1, 2), 0.2F);
  }
}

TEST(FillLetterbox, ScalesAStepEdgeToWhereTheGeometrySaysItLies) {
  cv::Mat image(40, 80, CV_8UC1, cv::Scalar(0));
  image.colRange(32, 80) = 255;
  const Letterbox letterbox(image.size(), {160, 160});
  std::vector<float> planes;
  fill_letterbox(image, letterbox, planes);
  // The edge at x = 32 goes to 64: linear interpolation gives a quarter on the left of it, three quarters on
  // the right.
  EXPECT_NEAR(value(planes, {160, 160}, 0, 63, 80), 0.25, 0.01);
  EXPECT_NEAR(value(planes, {160, 160}, 0, 64, 80), 0.75, 0.01);
  EXPECT_NEAR(letterbox.to_input({32, 0}).x, 64.0, 1e-9);
}

}  // namespace
}  // namespace ipl_slam
