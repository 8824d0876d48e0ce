#include "features/line_descriptor.hpp"

#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "features/test_images.hpp"

namespace ipl_slam {
namespace {

LineSegment segment(float u0, float v0, float u1, float v1, int octave = 0) {
  LineSegment s;
  s.start_pixel = s.start = {u0, v0};
  s.end_pixel = s.end = {u1, v1};
  s.octave = octave;
  return s;
}

Descriptor describe(const cv::Mat& image, const LineSegment& s) {
  return describe_segments(image, std::vector<LineSegment>{s}, {}).front();
}

// The image and the segment turned about a point.
cv::Mat turned(const cv::Mat& image, cv::Point2f center, double degrees) {
  cv::Mat out;
  cv::warpAffine(image, out, cv::getRotationMatrix2D(center, degrees, 1.0), image.size(), cv::INTER_CUBIC,
                 cv::BORDER_REFLECT);
  return out;
}

LineSegment turned(const LineSegment& s, cv::Point2f center, double degrees) {
  const cv::Mat M = cv::getRotationMatrix2D(center, degrees, 1.0);
  const auto move = [&](const Eigen::Vector2f& p) {
    return Eigen::Vector2f(
        static_cast<float>(M.at<double>(0, 0) * p.x() + M.at<double>(0, 1) * p.y() + M.at<double>(0, 2)),
        static_cast<float>(M.at<double>(1, 0) * p.x() + M.at<double>(1, 1) * p.y() + M.at<double>(1, 2)));
  };
  const Eigen::Vector2f a = move(s.start_pixel), b = move(s.end_pixel);
  return segment(a.x(), a.y(), b.x(), b.y(), s.octave);
}

TEST(LineDescriptor, IsTheSameWhereTheImageIsShifted) {
  const cv::Mat scene = test::textured_image(400, 300);
  const cv::Mat a = scene(cv::Rect(0, 0, 360, 280)), b = scene(cv::Rect(17, 9, 360, 280));
  EXPECT_EQ(describe(a, segment(120.3F, 90.0F, 190.8F, 151.5F)),
            describe(b, segment(103.3F, 81.0F, 173.8F, 142.5F)));
}

TEST(LineDescriptor, ChangesLittleWhereTheImageIsTurned) {
  const cv::Mat a = test::textured_image(400, 300);
  const cv::Point2f center(200.0F, 150.0F);
  const LineSegment s = segment(170.0F, 140.0F, 240.0F, 160.0F);
  // Of unlike segments half of the bits differ. Interpolation and the nearest-pixel samples cost some, also
  // at an angle that makes rows of the image into columns.
  for (const double degrees : {2.0, 10.0, 33.0, 90.0, 170.0}) {
    const int distance =
        hamming_distance(describe(a, s), describe(turned(a, center, degrees), turned(s, center, degrees)));
    EXPECT_LE(distance, 25) << degrees;
  }
}

TEST(LineDescriptor, DoesNotDependOnBrightnessOffset) {
  cv::Mat a;
  test::textured_image(400, 300).convertTo(a, CV_8U, 0.7);
  const cv::Mat b = a + cv::Scalar(60);
  const LineSegment s = segment(100.0F, 90.0F, 200.0F, 140.0F);
  EXPECT_EQ(describe(a, s), describe(b, s));
}

TEST(LineDescriptor, HardlyDependsOnGain) {
  const cv::Mat a = test::textured_image(400, 300);
  cv::Mat b;
  a.convertTo(b, CV_8U, 0.5, 40.0);
  const LineSegment s = segment(100.0F, 90.0F, 200.0F, 140.0F);
  EXPECT_LE(hamming_distance(describe(a, s), describe(b, s)), 8);  // the halved image is rounded
}

TEST(LineDescriptor, TellsUnlikeSurroundingsApart) {
  const cv::Mat a = test::textured_image(400, 300, 1), b = test::textured_image(400, 300, 2);
  int total = 0, count = 0;
  for (int i = 0; i < 10; ++i) {
    const auto v = static_cast<float>(60 + 18 * i);
    const int distance = hamming_distance(describe(a, segment(100.0F, v, 200.0F, v + 20.0F)),
                                          describe(b, segment(100.0F, v, 200.0F, v + 20.0F)));
    EXPECT_GE(distance, 50) << i;
    total += distance, ++count;
  }
  EXPECT_GE(total / count, 90);  // 128 for independent bits; neighbouring bands share rows
}

TEST(LineDescriptor, KnowsWhichWayTheSegmentRuns) {
  const cv::Mat a = test::textured_image(400, 300);
  EXPECT_GE(hamming_distance(describe(a, segment(100.0F, 90.0F, 200.0F, 140.0F)),
                             describe(a, segment(200.0F, 140.0F, 100.0F, 90.0F))),
            60);
}

TEST(LineDescriptor, ReadsAnOctaveInTheHalvedImage) {
  const cv::Mat a = test::textured_image(300, 200);
  cv::Mat twice;
  cv::resize(a, twice, {}, 2.0, 2.0, cv::INTER_NEAREST);  // halved again, this is the image itself
  cv::copyMakeBorder(twice, twice, 0, 1, 0, 1, cv::BORDER_REPLICATE);  // also where the size is odd
  const Eigen::Vector2f start(80.0F, 70.0F), end(150.0F, 120.0F);
  const auto enlarged = [](const Eigen::Vector2f& p) -> Eigen::Vector2f { return 2.0F * p.array() + 0.5F; };
  const Eigen::Vector2f s = enlarged(start), e = enlarged(end);
  EXPECT_EQ(describe(a, segment(start.x(), start.y(), end.x(), end.y())),
            describe(twice, segment(s.x(), s.y(), e.x(), e.y(), 1)));
}

TEST(LineDescriptor, CountsOnlyWhatLiesInsideTheImage) {
  // The same segment, once with the image cut off 12 pixels beyond it: the cut bands are incomplete, the
  // others are not touched, so most of the bits stay.
  const cv::Mat scene = test::textured_image(400, 300);
  const LineSegment s = segment(100.0F, 112.0F, 220.0F, 112.0F);
  const cv::Mat below = scene(cv::Rect(0, 100, 400, 200)).clone();
  const int distance =
      hamming_distance(describe(scene, s), describe(below, segment(100.0F, 12.0F, 220.0F, 12.0F)));
  EXPECT_GT(distance, 0);
  EXPECT_LE(distance, 90);
}

TEST(LineDescriptor, IsDefinedForSegmentsThatStickOutOrLieOutside) {
  const cv::Mat a = test::textured_image(320, 240);
  const std::vector<LineSegment> odd = {
      segment(-0.4F, -0.4F, 319.4F, 239.4F),   segment(0.0F, 0.0F, 319.0F, 0.0F),
      segment(319.0F, 0.0F, 319.0F, 239.0F),   segment(-500.0F, -500.0F, -400.0F, -450.0F),
      segment(1e6F, 1e6F, 1e6F + 50.0F, 1e6F), segment(50.0F, 50.0F, 50.0F, 50.0F),
      segment(50.0F, 50.0F, 51.0F, 50.0F),     segment(20.0F, 20.0F, 60.0F, 60.0F, 9)};
  const std::vector<Descriptor> descriptors = describe_segments(a, odd, {});
  ASSERT_EQ(descriptors.size(), odd.size());
  EXPECT_EQ(descriptors[3], Descriptor{});  // nothing inside: all bands are zero
  EXPECT_EQ(descriptors[4], Descriptor{});
  EXPECT_NE(descriptors[5], Descriptor{});  // a single column of samples
}

TEST(LineDescriptor, DoesNotSeeBeyondTheImage) {
  const cv::Mat scene = test::noise_image(320, 240);
  const cv::Mat part = scene(cv::Rect(40, 30, 200, 150));
  const LineSegment s = segment(10.0F, 1.0F, 150.0F, 1.0F);
  EXPECT_EQ(describe(part, s), describe(part.clone(), s));
}

TEST(LineDescriptor, IsTheSameAgain) {
  const cv::Mat a = test::noise_image(320, 240);
  const LineSegment s = segment(50.0F, 50.0F, 200.0F, 90.0F);
  EXPECT_EQ(describe(a, s), describe(a.clone(), s));
}

TEST(LineDescriptor, OfNothingIsNothing) {
  EXPECT_TRUE(describe_segments(test::noise_image(64, 48), {}, {}).empty());
}

TEST(LineDescriptor, RefusesWhatItCannotDescribe) {
  const std::vector<LineSegment> good = {segment(5.0F, 5.0F, 30.0F, 9.0F)};
  const std::vector<LineSegment> bad = {segment(5.0F, 5.0F, 30.0F, 9.0F, -1)};
  const cv::Mat image = test::noise_image(64, 48);
  LineDescriptorOptions few;
  few.bands = 8;
  EXPECT_THROW(static_cast<void>(describe_segments(cv::Mat(), good, {})), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(describe_segments(cv::Mat(48, 64, CV_8UC3), good, {})),
               std::invalid_argument);
  EXPECT_THROW(static_cast<void>(describe_segments(image, bad, {})), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(describe_segments(image, good, few)), std::invalid_argument);
}

}  // namespace
}  // namespace ipl_slam
