#include "segmentation/bit_mask.hpp"

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "segmentation/random_mask.hpp"

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
  for (const auto& [first, last] : {std::pair{3, 190}, {0, 64}, {64, 128}, {63, 65}, {10, 10}, {130, 200}}) {
    BitMask mask(cv::Size(200, 2));
    mask.set_run(1, first, last);
    EXPECT_EQ(mask.area(), last - first);
    const cv::Rect run = first < last ? cv::Rect(first, 1, last - first, 1) : cv::Rect();
    EXPECT_EQ(mask.bounding_box(), run);
  }
}

class RandomMask : public testing::TestWithParam<cv::Size> {};

TEST_P(RandomMask, IsTreatedTheSameByBothBodies) {
  const cv::Mat image = test::random_mask_image(GetParam(), 1),
                other = test::random_mask_image(GetParam(), 2);
  const BitMask a = BitMask::from_image(image, Simd::portable),
                b = BitMask::from_image(other, Simd::portable);
  const cv::Mat both = (image != 0) & (other != 0), either = (image != 0) | (other != 0);
  for (const Simd simd : {Simd::portable, best_simd()}) {
    EXPECT_EQ(BitMask::from_image(image, simd), a);
    EXPECT_EQ(cv::countNonZero(a.to_image(simd) != (image != 0)), 0);
    EXPECT_EQ(a.area(simd), cv::countNonZero(image));
    EXPECT_EQ(intersection_area(a, b, simd), cv::countNonZero(both));
    EXPECT_EQ(iou(a, b, simd), static_cast<double>(cv::countNonZero(both)) / cv::countNonZero(either));
  }
}

TEST_P(RandomMask, HasTheBoundingBoxThatOpenCvFinds) {
  const cv::Size size = GetParam();
  cv::Mat image = cv::Mat::zeros(size, CV_8UC1);
  const cv::Rect part(size.width / 3, size.height / 4, size.width / 2, size.height / 3);
  test::random_mask_image(part.size(), 3).copyTo(image(part));
  EXPECT_EQ(BitMask::from_image(image).bounding_box(), cv::boundingRect(image));
}

// Sparse, so that discs do not run into one another everywhere, up to the image's border.
TEST_P(RandomMask, GrowsByADisc) {
  const cv::Size size = GetParam();
  cv::Mat image = cv::Mat::zeros(size, CV_8UC1);
  Random random(4);
  for (int i = 0; i < 6; ++i) {
    image.at<std::uint8_t>(random.uniform_int(0, size.height - 1), random.uniform_int(0, size.width - 1)) =
        255;
  }
  const BitMask mask = BitMask::from_image(image);
  for (const int radius : {0, 1, 2, 10}) {
    cv::Mat disc(2 * radius + 1, 2 * radius + 1, CV_8UC1);
    for (int y = -radius; y <= radius; ++y) {
      for (int x = -radius; x <= radius; ++x) {
        disc.at<std::uint8_t>(y + radius, x + radius) = x * x + y * y <= radius * radius;
      }
    }
    cv::Mat expected;
    cv::dilate(image, expected, disc);
    EXPECT_EQ(dilated(mask, radius), BitMask::from_image(expected)) << "radius " << radius;
  }
}

INSTANTIATE_TEST_SUITE_P(WidthsThatFillTheirLastWordAndThatDoNot, RandomMask,
                         testing::Values(cv::Size(64, 12), cv::Size(65, 12), cv::Size(127, 20),
                                         cv::Size(199, 21), cv::Size(640, 48), cv::Size(13, 9)));

}  // namespace
}  // namespace ipl_slam
