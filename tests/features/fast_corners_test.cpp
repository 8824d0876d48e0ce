#include "features/fast_corners.hpp"

#include <map>
#include <stdexcept>
#include <utility>

#include <gtest/gtest.h>
#include <opencv2/features2d.hpp>

#include "features/test_images.hpp"

namespace ipl_slam {
namespace {

cv::Rect inner_area(const cv::Mat& image, int border) {
  return {border, border, image.cols - 2 * border, image.rows - 2 * border};
}

cv::Mat scores(const cv::Mat& image, int threshold, Simd simd) {
  cv::Mat score = cv::Mat::zeros(image.size(), CV_8UC1);
  fast_score(image, inner_area(image, kFastRadius), threshold, score, simd);
  return score;
}

bool equal(const cv::Mat& a, const cv::Mat& b) {
  return cv::countNonZero(a != b) == 0;
}

TEST(FastCorners, FindsTheCornersAndScoresOfTheReferenceDetector) {
  const cv::Mat image = test::textured_image(200, 150);
  std::vector<cv::KeyPoint> reference;
  cv::FAST(image, reference, 12, false);
  // Without suppression the reference gives no scores; with it, of the maxima only.
  std::vector<cv::KeyPoint> maxima;
  cv::FAST(image, maxima, 12, true);
  ASSERT_GT(maxima.size(), 100U);

  const cv::Mat score = scores(image, 12, best_simd());
  EXPECT_EQ(cv::countNonZero(score), static_cast<int>(reference.size()));
  for (const cv::KeyPoint& k : reference) EXPECT_GT(score.at<std::uint8_t>(k.pt), 12);
  // The reference's score is the largest threshold at which the test "brighter by more than t" holds: one
  // less.
  for (const cv::KeyPoint& k : maxima)
    EXPECT_EQ(score.at<std::uint8_t>(k.pt) - 1, static_cast<int>(k.response));
}

TEST(FastCorners, VectorAndPortableCodeGiveTheSameScores) {
  if (best_simd() == Simd::portable) GTEST_SKIP() << "this processor has no AVX2";
  // Widths around the register width of 32, where blocks overlap or do not fit at all.
  for (const int width : {20, 37, 38, 39, 69, 70, 71, 133}) {
    const cv::Mat noise = test::noise_image(width, 40);
    const cv::Mat texture = test::textured_image(width, 40);
    for (const int threshold : {0, 7, 60, 200, 254}) {
      EXPECT_TRUE(equal(scores(noise, threshold, Simd::avx2), scores(noise, threshold, Simd::portable)));
      EXPECT_TRUE(equal(scores(texture, threshold, Simd::avx2), scores(texture, threshold, Simd::portable)));
    }
  }
}

TEST(FastCorners, VectorAndPortableCodeFindTheSameMaxima) {
  if (best_simd() == Simd::portable) GTEST_SKIP() << "this processor has no AVX2";
  for (const int width : {34, 35, 66, 100, 131}) {
    cv::Mat score = test::noise_image(width, 40);
    score /= 32;  // few values: many ties between neighbours
    std::vector<Corner> a, b;
    find_score_maxima(score, inner_area(score, 1), a, Simd::avx2);
    find_score_maxima(score, inner_area(score, 1), b, Simd::portable);
    ASSERT_EQ(a.size(), b.size());
    ASSERT_FALSE(a.empty());
    for (std::size_t i = 0; i < a.size(); ++i) {
      EXPECT_EQ(std::tuple(a[i].x, a[i].y, a[i].score), std::tuple(b[i].x, b[i].y, b[i].score));
    }
  }
}

TEST(FastCorners, APlateauOfEqualScoresGivesOneMaximum) {
  cv::Mat score = cv::Mat::zeros(20, 70, CV_8UC1);
  score(cv::Rect(30, 8, 2, 2)) = 50;
  std::vector<Corner> corners;
  find_score_maxima(score, inner_area(score, 1), corners);
  ASSERT_EQ(corners.size(), 1U);
  EXPECT_EQ(corners[0].x, 30);
  EXPECT_EQ(corners[0].y, 8);
  EXPECT_EQ(corners[0].score, 50);
}

TEST(FastCorners, RefusesAreasThatReachOverTheBorderAndWrongTypes) {
  const cv::Mat image = test::noise_image(60, 60);
  cv::Mat score = cv::Mat::zeros(image.size(), CV_8UC1);
  EXPECT_THROW(fast_score(image, inner_area(image, 2), 7, score), std::invalid_argument);
  EXPECT_THROW(fast_score(image, inner_area(image, 3), 255, score), std::invalid_argument);
  cv::Mat wide_score(image.size(), CV_16UC1);
  EXPECT_THROW(fast_score(image, inner_area(image, 3), 7, wide_score), std::invalid_argument);
  std::vector<Corner> corners;
  EXPECT_THROW(find_score_maxima(score, inner_area(score, 0), corners), std::invalid_argument);
}

}  // namespace
}  // namespace ipl_slam
