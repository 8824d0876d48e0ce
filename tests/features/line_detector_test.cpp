#include "features/line_detector.hpp"

#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "features/test_images.hpp"

namespace ipl_slam {
namespace {

using Eigen::Vector2d;

constexpr int kWidth = 320, kHeight = 240;
constexpr double kBlur = 0.7;  // pixels, sigma of an edge as a sharp lens draws it

// How much of a pixel lies beyond an edge at this distance behind it.
double beyond(double distance) {
  return 0.5 * std::erfc(-distance / (std::numbers::sqrt2 * kBlur));
}

// Grey image of a function of the pixel position.
cv::Mat drawn(const std::function<double(const Vector2d&)>& grey, int width = kWidth, int height = kHeight) {
  cv::Mat image(height, width, CV_8UC1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(grey(Vector2d(x, y)));
    }
  }
  return image;
}

// Bright box on dark with edges at the given places.
cv::Mat bright_box(double left, double top, double right, double bottom) {
  return drawn([=](const Vector2d& p) {
    return 50.0 + 120.0 * (beyond(p.x() - left) - beyond(p.x() - right)) *
                      (beyond(p.y() - top) - beyond(p.y() - bottom));
  });
}

// Bright on one side of the line through `point`, along `degrees` from the u-axis; the bright side is on the
// right.
cv::Mat half_plane(const Vector2d& point, double degrees, double step = 100.0) {
  const double angle = degrees * std::numbers::pi / 180.0;
  const Vector2d right(-std::sin(angle), std::cos(angle));
  return drawn([=](const Vector2d& p) { return 80.0 + step * beyond(right.dot(p - point)); });
}

std::vector<LineSegment> detect(const cv::Mat& image, LineMethod method, LineDetectorOptions options = {}) {
  return LineDetector(method, options, test::simple_camera(image.cols, image.rows)).detect(image);
}

double angle_between(const LineSegment& s, double degrees) {
  const Eigen::Vector2f d = s.end - s.start;
  return std::abs(std::remainder(std::atan2(d.y(), d.x()) * 180.0 / std::numbers::pi - degrees, 360.0));
}

class LineDetectorTest : public testing::TestWithParam<LineMethod> {};

TEST_P(LineDetectorTest, a_bright_box_gives_its_four_sides_with_the_bright_side_on_the_right) {
  const auto segments = detect(bright_box(60.0, 50.0, 250.0, 180.0), GetParam());
  ASSERT_EQ(segments.size(), 4U);
  // Bright on the right: clockwise as seen, along the top to the right and down the right side.
  const Vector2d corners[4] = {{60, 50}, {250, 50}, {250, 180}, {60, 180}};
  for (int side = 0; side < 4; ++side) {
    const Vector2d from = corners[side], to = corners[(side + 1) % 4];
    int found = 0;
    for (const LineSegment& s : segments) {
      // Detectors stop short of a corner, where gradients turn.
      if ((s.start.cast<double>() - from).norm() > 4.0 || (s.end.cast<double>() - to).norm() > 4.0) continue;
      ++found;
      EXPECT_NEAR(s.contrast, 120.0F, 10.0F);
      EXPECT_EQ(s.octave, 0);
      EXPECT_EQ(s.start, s.start_pixel);  // no distortion
      EXPECT_EQ(s.end, s.end_pixel);
      EXPECT_FALSE(s.depth.known());
    }
    EXPECT_EQ(found, 1) << "side " << side;
  }
}

TEST_P(LineDetectorTest, an_inverted_image_turns_every_segment_round) {
  const cv::Mat image = half_plane({160.0, 120.0}, 20.0, 90.0);
  const auto segments = detect(image, GetParam());
  const auto inverted = detect(255 - image, GetParam());
  ASSERT_EQ(segments.size(), 1U);
  ASSERT_EQ(inverted.size(), 1U);
  EXPECT_LT(angle_between(segments[0], 20.0), 0.2);
  EXPECT_LT(angle_between(inverted[0], 200.0), 0.2);
  // Not to the bit: both start somewhere else.
  EXPECT_LT((segments[0].start - inverted[0].end).norm(), 2.0F);
  EXPECT_LT((segments[0].end - inverted[0].start).norm(), 2.0F);
}

TEST_P(LineDetectorTest, places_an_edge_to_a_tenth_of_a_pixel_on_either_octave) {
  for (const int octave : {0, 1}) {
    for (const double degrees : {0.0, 90.0, 180.0, 270.0, 17.0, 135.0}) {
      double mean = 0.0;
      constexpr int kPlaces = 10;  // half a pixel apart: over 5 px, after which LSD's two samplings repeat
      for (int i = 0; i < kPlaces; ++i) {
        const double angle = degrees * std::numbers::pi / 180.0;
        const Vector2d right(-std::sin(angle), std::cos(angle));
        const Vector2d point = Vector2d(160.0, 120.0) + 0.5 * i * right;
        cv::Mat image = half_plane(point, degrees);
        // What octave 1 finds is octave 0 of the halved image, in other pixels.
        if (octave == 1) cv::pyrDown(image.clone(), image);
        const double scale = octave + 1.0;
        LineDetectorOptions options;
        options.octaves = 1;
        const auto segments = detect(image, GetParam(), options);
        ASSERT_EQ(segments.size(), 1U) << degrees << " degrees, octave " << octave;
        const Vector2d middle = 0.5 * scale * (segments[0].start + segments[0].end).cast<double>();
        mean += right.dot(middle - point) / kPlaces;
      }
      EXPECT_NEAR(mean, 0.0, 0.05) << degrees << " degrees, octave " << octave;
    }
  }
}

TEST_P(LineDetectorTest, an_edge_too_soft_for_full_size_is_found_on_the_half_size_image_in_its_place) {
  const double sigma = 6.0;
  const Vector2d point(160.0, 100.3);
  const cv::Mat image = drawn([&](const Vector2d& p) {
    return 80.0 + 60.0 * 0.5 * std::erfc(-(p.y() - point.y()) / (std::numbers::sqrt2 * sigma));
  });
  LineDetectorOptions options;
  options.octaves = 4;
  const auto segments = detect(image, GetParam(), options);
  ASSERT_GE(segments.size(), 1U);
  EXPECT_NEAR(0.5F * (segments[0].start.y() + segments[0].end.y()), point.y(),
              0.1 * std::ldexp(1.0, segments[0].octave));
  EXPECT_GE(segments[0].octave, 1);
  EXPECT_GT(segments[0].length(), 250.0F);
}

TEST_P(LineDetectorTest, a_gap_in_an_edge_is_bridged_and_a_wide_one_is_not) {
  const auto edge_with_gap = [](double gap) {
    return drawn([=](const Vector2d& p) {
      const double step = std::abs(p.x() - 160.0) < 0.5 * gap ? 0.0 : 100.0;
      return 80.0 + step * beyond(p.y() - 120.0 - 0.05 * p.x());
    });
  };
  // The gap itself has two sides, in the bright half; the long edge comes first.
  const auto bridged = detect(edge_with_gap(10.0), GetParam());
  ASSERT_GE(bridged.size(), 1U);
  EXPECT_GT(bridged[0].length(), 310.0F);
  const auto open = detect(edge_with_gap(60.0), GetParam());
  ASSERT_GE(open.size(), 2U);
  EXPECT_LT(open[0].length(), 140.0F);
}

TEST_P(LineDetectorTest, the_two_edges_of_a_thin_line_stay_two) {
  const cv::Mat image = drawn([](const Vector2d& p) {
    const double across = p.y() - 120.0 - 0.2 * (p.x() - 160.0);
    return 170.0 - 120.0 * (beyond(across + 2.0) - beyond(across - 2.0));
  });
  const auto segments = detect(image, GetParam());
  ASSERT_EQ(segments.size(), 2U);
  EXPECT_NEAR(angle_between(segments[0], std::atan2(segments[1].start.y() - segments[1].end.y(),
                                                    segments[1].start.x() - segments[1].end.x()) *
                                             180.0 / std::numbers::pi),
              0.0, 1.0);
}

TEST_P(LineDetectorTest, finds_edges_that_run_along_the_border_of_the_image) {
  const auto segments = detect(bright_box(5.0, 5.0, kWidth - 6.0, kHeight - 6.0), GetParam());
  ASSERT_EQ(segments.size(), 4U);
  for (const LineSegment& s : segments) {
    for (const Eigen::Vector2f& p : {s.start_pixel, s.end_pixel}) {
      EXPECT_TRUE(p.x() > 0.0F && p.y() > 0.0F && p.x() < kWidth - 1 && p.y() < kHeight - 1);
    }
  }
  // Cut off by the border on both sides.
  const auto cut = detect(half_plane({160.0, 120.0}, 30.0), GetParam());
  ASSERT_EQ(cut.size(), 1U);
  EXPECT_GT(cut[0].length(), 265.0F);  // 277 between the borders
}

TEST_P(LineDetectorTest, a_dark_last_row_is_no_edge) {
  cv::Mat image(kHeight, kWidth, CV_8UC1, cv::Scalar(150));
  image.row(kHeight - 1) = 10;
  image.col(0) = 10;
  EXPECT_TRUE(detect(image, GetParam()).empty());
}

TEST_P(LineDetectorTest, blank_and_noisy_images_have_no_edges) {
  EXPECT_TRUE(detect(cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(100)), GetParam()).empty());
  cv::Mat noise(kHeight, kWidth, CV_8UC1);
  cv::RNG random(1);
  random.fill(noise, cv::RNG::NORMAL, 100.0, 5.0);
  EXPECT_TRUE(detect(noise, GetParam()).empty());
  // Every pixel at random between black and white is more than any camera delivers.
  EXPECT_LE(detect(test::noise_image(kWidth, kHeight), GetParam()).size(), 3U);
}

TEST_P(LineDetectorTest, takes_images_of_any_size) {
  for (const cv::Size size :
       {cv::Size(16, 16), cv::Size(17, 40), cv::Size(41, 19), cv::Size(3, 3), cv::Size(1, 1)}) {
    const cv::Mat image = test::textured_image(size.width, size.height);
    EXPECT_NO_THROW(detect(image, GetParam())) << size;
  }
}

TEST_P(LineDetectorTest, refuses_an_image_that_is_not_the_cameras) {
  LineDetector detector(GetParam(), {}, test::simple_camera(kWidth, kHeight));
  EXPECT_THROW(detector.detect(cv::Mat(kWidth, kHeight, CV_8UC1)), std::invalid_argument);
  EXPECT_THROW(detector.detect(cv::Mat(kHeight, kWidth, CV_8UC3)), std::invalid_argument);
  EXPECT_THROW(detector.detect(cv::Mat()), std::invalid_argument);
}

// A straight edge as the camera with strong distortion draws it.
TEST_P(LineDetectorTest, an_edge_bent_by_the_lens_is_one_straight_segment) {
  Camera camera = test::simple_camera(640, 480);
  camera.k1 = 0.262383, camera.k2 = -0.953104, camera.p1 = -0.005358, camera.p2 = 0.002628;
  camera.k3 = 1.163314;  // TUM freiburg1
  const Vector2d point(320.0, 60.0), right(-0.08, 1.0);
  const cv::Mat image = drawn(
      [&](const Vector2d& p) {
        return 80.0 + 100.0 * beyond(right.normalized().dot(camera.undistort(p) - point));
      },
      640, 480);
  const auto segments = LineDetector(GetParam(), {}, camera).detect(image);
  ASSERT_EQ(segments.size(), 1U);
  EXPECT_GT(segments[0].length(), 500.0F);
  // Pieces of a curve are chords; their ends lie off it.
  EXPECT_NEAR(right.normalized().dot(segments[0].start.cast<double>() - point), 0.0, 2.0);
  EXPECT_NEAR(right.normalized().dot(segments[0].end.cast<double>() - point), 0.0, 2.0);
  EXPECT_LT(
      (camera.undistort(segments[0].start_pixel.cast<double>()) - segments[0].start.cast<double>()).norm(),
      1e-3);
}

TEST_P(LineDetectorTest, keeps_the_longest_longest_first) {
  const cv::Mat image = test::textured_image(640, 480);
  LineDetectorOptions options;
  const auto all = detect(image, GetParam(), options);
  ASSERT_GT(all.size(), 40U);
  for (std::size_t i = 1; i < all.size(); ++i) EXPECT_GE(all[i - 1].length(), all[i].length());
  EXPECT_GE(all.back().length(), options.min_length);
  options.max_segments = 20;
  const auto some = detect(image, GetParam(), options);
  ASSERT_EQ(some.size(), 20U);
  for (std::size_t i = 0; i < some.size(); ++i) EXPECT_EQ(some[i].start, all[i].start);
}

TEST_P(LineDetectorTest, weak_edges_are_dropped) {
  const cv::Mat image = half_plane({160.0, 120.0}, 10.0, 30.0);
  LineDetectorOptions options;
  options.min_contrast = 25.0;
  EXPECT_EQ(detect(image, GetParam(), options).size(), 1U);
  options.min_contrast = 35.0;
  EXPECT_TRUE(detect(image, GetParam(), options).empty());
}

TEST_P(LineDetectorTest, gives_the_same_bytes_every_time) {
  const cv::Mat image = test::textured_image(640, 480);
  LineDetector detector(GetParam(), {}, test::simple_camera(640, 480));
  const auto first = detector.detect(image), second = detector.detect(image);
  ASSERT_EQ(first.size(), second.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].start, second[i].start);
    EXPECT_EQ(first[i].end, second[i].end);
    EXPECT_EQ(first[i].contrast, second[i].contrast);
    EXPECT_EQ(first[i].octave, second[i].octave);
  }
}

INSTANTIATE_TEST_SUITE_P(methods, LineDetectorTest, testing::Values(LineMethod::kLsd, LineMethod::kEdges),
                         [](const auto& info) { return info.param == LineMethod::kLsd ? "lsd" : "edges"; });

}  // namespace
}  // namespace ipl_slam
