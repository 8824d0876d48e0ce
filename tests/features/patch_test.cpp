// Smoothing, orientation and descriptor: what is computed from the patch around a corner.
#include <cmath>
#include <numbers>
#include <set>
#include <stdexcept>

#include <gtest/gtest.h>

#include "features/brief.hpp"
#include "features/gaussian_blur.hpp"
#include "features/orientation.hpp"
#include "features/test_images.hpp"

namespace ipl_slam {
namespace {

TEST(GaussianBlur, StaysWithinTwoGreyLevelsOfTheExactFilter) {
  const cv::Mat image = test::textured_image(161, 90);
  cv::Mat ours(image.size(), CV_8UC1), exact, difference;
  gaussian_blur_7x7(image, ours);
  cv::GaussianBlur(image, exact, {7, 7}, 2.0, 2.0, cv::BORDER_REPLICATE);
  cv::absdiff(ours, exact, difference);
  double worst = 0.0;
  cv::minMaxLoc(difference, nullptr, &worst);
  // Two roundings to whole grey levels, and weights of 7 bits that are off by up to 0.4 of their step.
  EXPECT_LE(worst, 2.0);
  EXPECT_LT(cv::mean(difference)[0], 0.5);
}

TEST(GaussianBlur, VectorAndPortableCodeGiveTheSameBytes) {
  if (best_simd() == Simd::portable) GTEST_SKIP() << "this processor has no AVX2";
  for (const int width : {1, 31, 32, 33, 63, 64, 100}) {
    const cv::Mat image = test::noise_image(width, 9);
    cv::Mat a(image.size(), CV_8UC1), b(image.size(), CV_8UC1);
    gaussian_blur_7x7(image, a, Simd::avx2);
    gaussian_blur_7x7(image, b, Simd::portable);
    EXPECT_EQ(cv::countNonZero(a != b), 0) << "width " << width;
  }
}

TEST(GaussianBlur, RefusesToWorkInPlaceOrOnOtherTypes) {
  cv::Mat image = test::noise_image(40, 40);
  EXPECT_THROW(gaussian_blur_7x7(image, image), std::invalid_argument);
  cv::Mat color(40, 40, CV_8UC3);
  EXPECT_THROW(gaussian_blur_7x7(image, color), std::invalid_argument);
}

// Brightness that grows in one direction has its centroid in that direction.
TEST(PatchOrientation, PointsUpTheBrightnessGradient) {
  for (int degrees = 0; degrees < 360; degrees += 15) {
    const double angle = degrees * std::numbers::pi / 180.0;
    cv::Mat image(40, 40, CV_8UC1);
    for (int y = 0; y < 40; ++y) {
      for (int x = 0; x < 40; ++x) {
        image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(
            std::lround(128.0 + 5.0 * ((x - 20) * std::cos(angle) + (y - 20) * std::sin(angle))));
      }
    }
    const float found = patch_orientation(image.ptr(20, 20), static_cast<std::ptrdiff_t>(image.step));
    EXPECT_GE(found, 0.0F);
    EXPECT_LT(found, 2.0F * std::numbers::pi_v<float>);
    // Rounded grey levels over 700 pixels leave about a tenth of a degree.
    EXPECT_NEAR(std::remainder(found - angle, 2.0 * std::numbers::pi), 0.0, 0.005) << degrees << " degrees";
  }
}

TEST(PatchOrientation, AFlatPatchHasAngleZeroAndVectorCodeAgrees) {
  const cv::Mat flat(40, 40, CV_8UC1, cv::Scalar(255));
  EXPECT_EQ(patch_orientation(flat.ptr(20, 20), 40), 0.0F);
  const cv::Mat noise = test::noise_image(64, 64);
  for (int i = kPatchBorder; i < 64 - kPatchBorder; ++i) {
    const auto step = static_cast<std::ptrdiff_t>(noise.step);
    EXPECT_EQ(patch_orientation(noise.ptr(i, 80 - i), step, best_simd()),
              patch_orientation(noise.ptr(i, 80 - i), step, Simd::portable));
  }
}

TEST(Brief, TestsAreDistinctAndStayInsideTheDiscWhenTurned) {
  std::set<std::array<int, 4>> seen;
  for (const BriefTest& t : brief_pattern()) {
    EXPECT_LE(t.x1 * t.x1 + t.y1 * t.y1, kPatchRadius * kPatchRadius);
    EXPECT_LE(t.x2 * t.x2 + t.y2 * t.y2, kPatchRadius * kPatchRadius);
    EXPECT_FALSE(t.x1 == t.x2 && t.y1 == t.y2);
    EXPECT_TRUE(seen.insert({t.x1, t.y1, t.x2, t.y2}).second);
  }
}

TEST(Brief, BitsAreTheOutcomesOfTheTestsInOrder) {
  const cv::Mat image = test::noise_image(64, 64);
  const BriefDescriber describer;
  const Descriptor d = describer.describe(image.ptr(32, 32), static_cast<std::ptrdiff_t>(image.step), 0.0F);
  for (std::size_t i = 0; i < 256; ++i) {
    const BriefTest& t = brief_pattern()[i];
    const bool darker =
        image.at<std::uint8_t>(32 + t.y1, 32 + t.x1) < image.at<std::uint8_t>(32 + t.y2, 32 + t.x2);
    EXPECT_EQ((d[i / 64] >> (i % 64)) & 1U, darker ? 1U : 0U) << "test " << i;
  }
}

TEST(Brief, AQuarterTurnOfImageAndAngleLeavesTheDescriptorAsItIs) {
  const cv::Mat image = test::noise_image(65, 65);
  cv::Mat turned;
  cv::rotate(image, turned, cv::ROTATE_90_CLOCKWISE);  // the x axis turns onto y: angle + pi / 2
  const BriefDescriber describer;
  const auto step = static_cast<std::ptrdiff_t>(image.step);
  EXPECT_EQ(describer.describe(image.ptr(32, 32), step, 0.0F),
            describer.describe(turned.ptr(32, 32), step, std::numbers::pi_v<float> / 2));
}

TEST(Brief, VectorAndPortableCodeGiveTheSameDescriptors) {
  if (best_simd() == Simd::portable) GTEST_SKIP() << "this processor has no AVX2";
  const cv::Mat image = test::noise_image(64, 64);
  const BriefDescriber describer;
  const auto step = static_cast<std::ptrdiff_t>(image.step);
  for (int i = kPatchBorder; i < 64 - kPatchBorder; ++i) {
    const float angle = 0.2F * static_cast<float>(i - kPatchBorder);
    EXPECT_EQ(describer.describe(image.ptr(i, i), step, angle, Simd::avx2),
              describer.describe(image.ptr(i, i), step, angle, Simd::portable));
  }
}

}  // namespace
}  // namespace ipl_slam
