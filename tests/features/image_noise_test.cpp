#include "features/image_noise.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

cv::Mat even(int value, cv::Size size = {320, 240}) {
  return {size, CV_8UC1, cv::Scalar(value)};
}

bool same(const cv::Mat& a, const cv::Mat& b) {
  return cv::norm(a, b, cv::NORM_INF) == 0.0;
}

TEST(ImageNoise, HasTheDeviationItIsAskedForAndNoBias) {
  const cv::Mat grey = even(120);
  for (const double deviation : {1.0, 4.0, 20.0}) {
    cv::Scalar mean, spread;
    cv::meanStdDev(ImageNoise(deviation, 5).add(grey, 3), mean, spread);
    // Five standard errors of 76800 pixels. Rounding to whole grey values adds a variance of 1/12.
    const double expected = std::sqrt(deviation * deviation + 1.0 / 12.0);
    const auto pixels = static_cast<double>(grey.total());
    EXPECT_NEAR(mean[0], 120.0, 5.0 * expected / std::sqrt(pixels)) << deviation;
    EXPECT_NEAR(spread[0], expected, 5.0 * expected / std::sqrt(2.0 * pixels)) << deviation;
  }
}

TEST(ImageNoise, IsCutOffAtBlackAndWhite) {
  for (const int value : {0, 255}) {
    const cv::Mat noisy = ImageNoise(30.0, 0).add(even(value), 0);
    // Half of the noise points outwards; what is cut off there must not come back at the other end.
    const int kept = cv::countNonZero(noisy == value);
    EXPECT_NEAR(kept, 0.5 * static_cast<double>(noisy.total()), 0.03 * static_cast<double>(noisy.total()));
    EXPECT_LT(cv::norm(noisy, even(value), cv::NORM_INF), 3.5 * 30.0 + 1.0);
  }
}

TEST(ImageNoise, DependsOnSeedAndFrameAlone) {
  const cv::Mat grey = even(100);
  const cv::Mat noisy = ImageNoise(3.0, 1).add(grey, 7);
  EXPECT_TRUE(same(noisy, ImageNoise(3.0, 1).add(grey, 7)));
  EXPECT_FALSE(same(noisy, ImageNoise(3.0, 2).add(grey, 7)));
  EXPECT_FALSE(same(noisy, ImageNoise(3.0, 1).add(grey, 8)));
}

TEST(ImageNoise, OfNeighboursAndOfFramesIsUnrelated) {
  const cv::Mat grey = even(100);
  cv::Mat here, there;
  ImageNoise(10.0, 0).add(grey, 0).convertTo(here, CV_64F, 1.0, -100.0);
  ImageNoise(10.0, 0).add(grey, 1).convertTo(there, CV_64F, 1.0, -100.0);
  const auto correlation = [](const cv::Mat& a, const cv::Mat& b) {
    return a.dot(b) / std::sqrt(a.dot(a) * b.dot(b));
  };
  // Five standard deviations of the correlation of as many unrelated pairs.
  const double tolerance = 5.0 / std::sqrt(static_cast<double>(grey.total()));
  EXPECT_NEAR(correlation(here, there), 0.0, tolerance);
  EXPECT_NEAR(correlation(here.colRange(1, 320), here.colRange(0, 319)), 0.0, tolerance);
  EXPECT_NEAR(correlation(here.rowRange(1, 240), here.rowRange(0, 239)), 0.0, tolerance);
}

TEST(ImageNoise, LeavesTheGivenImageAlone) {
  const cv::Mat grey = even(100);
  const cv::Mat noisy = ImageNoise(5.0, 0).add(grey, 0);
  EXPECT_FALSE(same(noisy, grey));
  EXPECT_TRUE(same(grey, even(100)));
}

TEST(ImageNoise, OfNoDeviationIsNone) {
  const cv::Mat grey = even(100);
  EXPECT_EQ(ImageNoise(0.0, 1).add(grey, 2).data, grey.data) << "nothing need be copied";
}

TEST(ImageNoise, TakesPartOfAnImageForItsPixels) {
  const cv::Mat part = even(100)(cv::Rect(10, 20, 50, 40));
  EXPECT_TRUE(same(ImageNoise(5.0, 0).add(part, 0), ImageNoise(5.0, 0).add(part.clone(), 0)));
}

}  // namespace
}  // namespace ipl_slam
