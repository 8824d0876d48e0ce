#include "dynamics/shape_similarity.hpp"

#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace ipl_slam {
namespace {

// An L, whose invariants are all well above 0, turned by `degrees` and scaled, with a corner at (x, y).
cv::Mat l_image(double x, double y, double scale = 1.0, double degrees = 0.0) {
  cv::Mat image = cv::Mat::zeros(480, 640, CV_8UC1);
  std::vector<cv::Point> corners;
  const double c = std::cos(degrees * CV_PI / 180.0), s = std::sin(degrees * CV_PI / 180.0);
  for (const auto& [u, v] :
       {std::pair{0.0, 0.0}, {40.0, 0.0}, {40.0, 120.0}, {100.0, 120.0}, {100.0, 160.0}, {0.0, 160.0}}) {
    corners.emplace_back(static_cast<int>(std::lround(x + scale * (c * u - s * v))),
                         static_cast<int>(std::lround(y + scale * (s * u + c * v))));
  }
  cv::fillPoly(image, std::vector<std::vector<cv::Point>>{corners}, cv::Scalar(255));
  return image;
}

HuInvariants hu_of(const cv::Mat& image) {
  return hu_invariants(mask_moments(BitMask::from_image(image)));
}

BitMask rectangle(cv::Rect where) {
  BitMask mask(cv::Size(200, 100));
  for (int y = where.y; y < where.y + where.height; ++y) mask.set_run(y, where.x, where.x + where.width);
  return mask;
}

TEST(HuSimilarity, IsThatOfMatchShapes) {
  cv::Mat ellipse = cv::Mat::zeros(480, 640, CV_8UC1);
  cv::ellipse(ellipse, {300, 200}, {120, 50}, 30.0, 0.0, 250.0, cv::Scalar(255), cv::FILLED);
  const cv::Mat shapes[] = {l_image(100, 100), l_image(300, 250, 1.0, 137.0), ellipse};
  for (const cv::Mat& a : shapes) {
    for (const cv::Mat& b : shapes) {
      const double d = cv::matchShapes(a / 255, b / 255, cv::CONTOURS_MATCH_I2, 0.0);
      EXPECT_NEAR(hu_similarity(hu_of(a), hu_of(b)), 1.0 / (1.0 + d), 1e-6);
    }
  }
}

TEST(HuSimilarity, IsOneForWhatWasOnlyShifted) {
  // A shift by whole pixels keeps all differences of coordinates; what is left is rounding.
  EXPECT_NEAR(hu_similarity(hu_of(l_image(100, 100)), hu_of(l_image(317, 241))), 1.0, 1e-9);
}

TEST(HuSimilarity, IsNearOneForWhatWasScaledOrTurned) {
  const HuInvariants here = hu_of(l_image(300, 200));
  // The outline is rounded to pixels, which changes invariants of order 0.01 by per cents of their size.
  EXPECT_GT(hu_similarity(here, hu_of(l_image(300, 200, 1.5))), 0.9);
  EXPECT_GT(hu_similarity(here, hu_of(l_image(300, 200, 1.0, 90.0))), 0.9);
  EXPECT_GT(hu_similarity(here, hu_of(l_image(300, 200, 1.0, 33.0))), 0.9);
}

// h1 and h2 of a rectangle follow from its sides; the others are 0 and left out.
TEST(HuSimilarity, OfTwoRectanglesFollowsTheFormula) {
  const auto h = [](double w, double height) {
    const double n20 = (w * w - 1.0) / 12.0 / (w * height),
                 n02 = (height * height - 1.0) / 12.0 / (w * height);
    return std::pair{n20 + n02, (n20 - n02) * (n20 - n02)};
  };
  const auto [a1, a2] = h(60, 30);
  const auto [b1, b2] = h(90, 20);
  const double d = std::abs(std::log10(a1) - std::log10(b1)) + std::abs(std::log10(a2) - std::log10(b2));
  const HuInvariants a = hu_invariants(mask_moments(rectangle({10, 10, 60, 30})));
  const HuInvariants b = hu_invariants(mask_moments(rectangle({5, 5, 90, 20})));
  EXPECT_NEAR(hu_similarity(a, b), 1.0 / (1.0 + d), 1e-9);
}

TEST(HuSimilarity, LeavesOutWhatIsZeroOrNoise) {
  const HuInvariants shape = {0.2, 0.01, 1e-3, 1e-4, 1e-7, 1e-6, 0.0};
  HuInvariants noisy = shape;
  noisy[4] = -1e-7;  // a change of sign that would cost 14
  noisy[5] = 1e-12;
  noisy[6] = -1e-9;
  EXPECT_EQ(hu_similarity(shape, noisy), 1.0);
  EXPECT_EQ(hu_similarity(shape, HuInvariants{}), 1.0) << "a pixel says nothing about shape";
}

TEST(HuSimilarity, CountsAChangeOfSignInFull) {
  const HuInvariants a = {0.2, 0.01, 1e-3, 1e-4, 1e-4, 0.0, 0.0};
  HuInvariants b = a;
  b[4] = -1e-4;
  EXPECT_NEAR(hu_similarity(a, b), 1.0 / (1.0 + 8.0), 1e-12);
}

TEST(ShapeSimilarity, IsOneForIdenticalMasks) {
  const BitMask mask = BitMask::from_image(l_image(100, 100));
  EXPECT_DOUBLE_EQ(shape_similarity(mask, mask, 0.5), 1.0);
}

TEST(ShapeSimilarity, WeighsOverlapAgainstShape) {
  const BitMask a = rectangle({10, 10, 60, 30}), half = rectangle({40, 10, 60, 30});
  const double overlap = 30.0 / 90.0;
  EXPECT_NEAR(shape_similarity(a, half, 0.5), 0.5 * overlap + 0.5, 1e-9);
  EXPECT_NEAR(shape_similarity(a, half, 1.0), overlap, 1e-9);
  EXPECT_NEAR(shape_similarity(a, rectangle({100, 60, 60, 30}), 0.5), 0.5, 1e-9) << "same shape elsewhere";
}

TEST(ShapeSimilarity, OfNothingIsZero) {
  const BitMask nothing(cv::Size(200, 100)), something = rectangle({10, 10, 60, 30});
  EXPECT_EQ(shape_similarity(nothing, something, 0.5), 0.0);
  EXPECT_EQ(shape_similarity(something, nothing, 0.5), 0.0);
  EXPECT_EQ(shape_similarity(nothing, nothing, 0.5), 0.0);
}

TEST(ShapeSimilarity, IsFiniteForOnePixelAndForALine) {
  const BitMask pixel = rectangle({10, 10, 1, 1}), line = rectangle({0, 20, 150, 1});
  EXPECT_DOUBLE_EQ(shape_similarity(pixel, pixel, 0.5), 1.0);
  EXPECT_DOUBLE_EQ(shape_similarity(line, line, 0.5), 1.0);
  EXPECT_DOUBLE_EQ(shape_similarity(pixel, line, 0.5), 0.5);
}

}  // namespace
}  // namespace ipl_slam
