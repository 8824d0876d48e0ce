#include "segmentation/bit_mask.hpp"

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

// 70 pixels wide: the second word of a row is not full.
cv::Mat rectangle(cv::Rect where) {
  cv::Mat image = cv::Mat::zeros(5, 70, CV_8UC1);
  image(where) = 255;
  return image;
}

TEST(BitMask, IsTheImageItWasMadeFrom) {
  const cv::Mat image = rectangle({60, 1, 10, 3});
  const BitMask mask = BitMask::from_image(image);
  EXPECT_EQ(cv::countNonZero(mask.to_image() != image), 0);
  EXPECT_EQ(mask.area(), 30);
  EXPECT_EQ(mask.bounding_box(), cv::Rect(60, 1, 10, 3));
}

TEST(BitMask, OfNothingHasNoBoxAndNoOverlap) {
  const BitMask nothing(cv::Size(70, 5));
  EXPECT_TRUE(nothing.none());
  EXPECT_TRUE(nothing.bounding_box().empty());
  EXPECT_EQ(iou(nothing, nothing), 0.0);
}

TEST(BitMask, OverlapIsCountedInPixels) {
  const BitMask a = BitMask::from_image(rectangle({0, 0, 66, 2}));
  const BitMask b = BitMask::from_image(rectangle({60, 1, 10, 2}));
  EXPECT_EQ(intersection_area(a, b), 6);
  EXPECT_DOUBLE_EQ(iou(a, b), 6.0 / (132 + 20 - 6));
}

TEST(BitMask, ARunMayCrossWords) {
  BitMask mask(cv::Size(200, 2));
  mask.set_run(1, 3, 190);
  EXPECT_EQ(mask.area(), 187);
  EXPECT_EQ(mask.bounding_box(), cv::Rect(3, 1, 187, 1));
}

}  // namespace
}  // namespace ipl_slam
