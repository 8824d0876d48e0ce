#include "segmentation/mask_moments.hpp"

#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "segmentation/random_mask.hpp"

namespace ipl_slam {
namespace {

void expect_moments_of_opencv(const cv::Mat& image) {
  const Moments<std::int64_t> m = mask_moments(BitMask::from_image(image));
  const cv::Moments expected = cv::moments(image, true);
  // OpenCV adds up in double: equal as long as the sums stay below 2^53, as they do here.
  EXPECT_EQ(static_cast<double>(m.m00), expected.m00);
  EXPECT_EQ(static_cast<double>(m.m10), expected.m10);
  EXPECT_EQ(static_cast<double>(m.m01), expected.m01);
  EXPECT_EQ(static_cast<double>(m.m20), expected.m20);
  EXPECT_EQ(static_cast<double>(m.m11), expected.m11);
  EXPECT_EQ(static_cast<double>(m.m02), expected.m02);
  EXPECT_EQ(static_cast<double>(m.m30), expected.m30);
  EXPECT_EQ(static_cast<double>(m.m21), expected.m21);
  EXPECT_EQ(static_cast<double>(m.m12), expected.m12);
  EXPECT_EQ(static_cast<double>(m.m03), expected.m03);
}

TEST(MaskMoments, AreThoseOfOpenCv) {
  for (const cv::Size size : {cv::Size(64, 20), cv::Size(65, 33), cv::Size(199, 40), cv::Size(640, 48)}) {
    expect_moments_of_opencv(test::random_mask_image(size, 7));
    expect_moments_of_opencv(cv::Mat(size, CV_8UC1, cv::Scalar(1)));  // runs to the end of the last word
  }
}

TEST(MaskMoments, OfOnePixelAreThePowersOfItsPlace) {
  BitMask mask(cv::Size(100, 50));
  mask.set(70, 30);
  const Moments<std::int64_t> m = mask_moments(mask);
  EXPECT_EQ(m.m00, 1);
  EXPECT_EQ(m.m30, 70 * 70 * 70);
  EXPECT_EQ(m.m12, 70 * 30 * 30);
}

TEST(MaskMoments, AreExactForTheLargestMasks) {
  constexpr std::int64_t kSide = 8192, kSum = kSide * (kSide - 1) / 2;  // of 0 .. kSide - 1
  const BitMask full = BitMask::from_image(cv::Mat(kSide, kSide, CV_8UC1, cv::Scalar(1)));
  const Moments<std::int64_t> m = mask_moments(full);
  EXPECT_EQ(m.m00, kSide * kSide);
  EXPECT_EQ(m.m30, kSide * (kSum * kSum));  // sum of x^3 = (sum of x)^2
  EXPECT_EQ(m.m03, m.m30);
  EXPECT_EQ(m.m12, kSum * (kSum * (2 * kSide - 1) / 3));
}

TEST(HuInvariants, DoNotDependOnThePlaceInTheLargestMasks) {
  const cv::Mat shape = test::random_mask_image({640, 48}, 7);
  const auto hu_at = [&shape](int x, int y) {
    cv::Mat image = cv::Mat::zeros(8192, 8192, CV_8UC1);
    shape.copyTo(image(cv::Rect({x, y}, shape.size())));
    return hu_invariants(mask_moments(BitMask::from_image(image)));
  };
  const HuInvariants near = hu_at(0, 0), far = hu_at(8192 - 640, 8192 - 48);
  for (std::size_t i = 0; i < 7; ++i) EXPECT_DOUBLE_EQ(near[i], far[i]);
}

TEST(HuInvariants, AreThoseOfOpenCv) {
  cv::Mat image = cv::Mat::zeros(480, 640, CV_8UC1);
  cv::ellipse(image, {300, 200}, {120, 50}, 30.0, 0.0, 250.0, cv::Scalar(255), cv::FILLED);
  double expected[7];
  cv::HuMoments(cv::moments(image, true), expected);
  const HuInvariants h = hu_invariants(mask_moments(BitMask::from_image(image)));
  // OpenCV's central moments lose digits where raw moments of 1e13 cancel.
  for (std::size_t i = 0; i < 7; ++i) EXPECT_NEAR(h[i], expected[i], 1e-6 * std::abs(expected[i])) << i;
}

// Pixels are points, so a row of w pixels has second moment w (w^2 - 1) / 12 about its middle.
TEST(HuInvariants, OfARectangleFollowTheFormula) {
  const double w = 90, h = 40;
  BitMask mask(cv::Size(200, 100));
  for (int y = 20; y < 60; ++y) mask.set_run(y, 30, 120);
  const double n20 = (w * w - 1.0) / 12.0 / (w * h), n02 = (h * h - 1.0) / 12.0 / (w * h);
  const HuInvariants hu = hu_invariants(mask_moments(mask));
  EXPECT_NEAR(hu[0], n20 + n02, 1e-12);
  EXPECT_NEAR(hu[1], (n20 - n02) * (n20 - n02), 1e-12);
  for (std::size_t i = 2; i < 7; ++i) EXPECT_NEAR(hu[i], 0.0, 1e-20) << "a rectangle is symmetric";
}

TEST(HuInvariants, AreZeroForNothingAndForOnePixel) {
  BitMask mask(cv::Size(64, 64));
  EXPECT_EQ(hu_invariants(mask_moments(mask)), HuInvariants{});
  mask.set(63, 63);
  EXPECT_EQ(hu_invariants(mask_moments(mask)), HuInvariants{});
}

TEST(HuInvariants, DoNotDependOnWhereRealMomentsHaveTheirOrigin) {
  Moments<double> here, there;
  const auto add = [](Moments<double>& m, double x, double y) {
    m.m00 += 1, m.m10 += x, m.m01 += y, m.m20 += x * x, m.m11 += x * y, m.m02 += y * y;
    m.m30 += x * x * x, m.m21 += x * x * y, m.m12 += x * y * y, m.m03 += y * y * y;
  };
  for (int i = 0; i < 50; ++i) {
    const double x = 0.37 * i, y = 5.0 * std::sin(0.2 * i * i);
    add(here, x, y);
    add(there, x + 20.25, y - 30.5);
  }
  const HuInvariants a = hu_invariants(here), b = hu_invariants(there);
  for (std::size_t i = 0; i < 7; ++i) EXPECT_NEAR(a[i], b[i], 1e-9 * std::abs(a[i]));
}

}  // namespace
}  // namespace ipl_slam
