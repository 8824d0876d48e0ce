#include "tracking/line_search.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include <gtest/gtest.h>

#include "common/random.hpp"
#include "geometry/line3.hpp"

namespace ipl_slam {
namespace {

using Point = Eigen::Vector2d;

const Camera kCamera{};
// A lens like that of the first Kinect: up to some 10 pixels at the corners.
const Camera kBent{.fx = 517.3,
                   .fy = 516.5,
                   .cx = 318.6,
                   .cy = 255.3,
                   .k1 = 0.262383,
                   .k2 = -0.953104,
                   .p1 = -0.005358,
                   .p2 = 0.002628,
                   .k3 = 1.163314};
constexpr double kDark = 80.0, kBright = 120.0;
constexpr float kContrast = 40.0F;

// Grey value of a blurred edge at a signed distance from it, bright on the positive side.
double blurred_step(double distance, double blur = 0.8) {
  return 0.5 * (1.0 + std::erf(distance / (blur * std::sqrt(2.0))));
}

// Draws a picture given in undistorted pixels, with noise.
cv::Mat draw(const Camera& camera, const std::function<double(const Point&)>& grey, double noise = 3.0) {
  Random random(4);
  cv::Mat image(camera.height, camera.width, CV_8UC1);
  for (int v = 0; v < image.rows; ++v) {
    for (int u = 0; u < image.cols; ++u) {
      const double value = grey(camera.undistort(Point(u, v))) + noise * random.normal();
      image.at<std::uint8_t>(v, u) = cv::saturate_cast<std::uint8_t>(value);
    }
  }
  return image;
}

struct Piece {
  Point start, end;
};

cv::Mat draw_edge(const Camera& camera, const Piece& edge, double noise = 3.0, double blur = 0.8) {
  const ImageLine line = image_line(edge.start, edge.end).value();
  return draw(
      camera,
      [&](const Point& p) {
        return kDark + (kBright - kDark) * blurred_step(signed_distance(line, p), blur);
      },
      noise);
}

// The piece shifted across by `offset` at its start and by `offset` + `tilt` at its end.
ExpectedLine beside(const Piece& p, double offset, double tilt = 0.0) {
  const Point normal = image_line(p.start, p.end)->head<2>();
  return {p.start + offset * normal, p.end + (offset + tilt) * normal, kContrast};
}

double distance(const FoundLine& found, const Piece& truth) {
  const ImageLine line = image_line(truth.start, truth.end).value();
  return std::max(std::abs(signed_distance(line, found.start)), std::abs(signed_distance(line, found.end)));
}

std::optional<FoundLine> find(const cv::Mat& grey, const ExpectedLine& expected, double radius = 5.0,
                              const Camera& camera = kCamera) {
  return LineSearch(camera, {}).find(grey, expected, radius);
}

const Piece kAslant{{200.3, 140.6}, {330.1, 260.2}};

TEST(LineSearch, FindsANoisyEdgeToAFractionOfAPixel) {
  const cv::Mat grey = draw_edge(kCamera, kAslant);
  const double length = (kAslant.end - kAslant.start).norm();
  for (const double offset : {-4.3, -1.7, 0.0, 0.5, 2.2, 3.9}) {
    for (const double tilt : {-0.8, 0.0, 0.8}) {
      const auto found = find(grey, beside(kAslant, offset, tilt));
      ASSERT_TRUE(found) << offset << " " << tilt;
      EXPECT_LT(distance(*found, kAslant), 0.15) << offset << " " << tilt;
      EXPECT_GT((found->end - found->start).dot(kAslant.end - kAslant.start), 0.9 * length * length);
      EXPECT_NEAR(found->contrast, kContrast, 4.0F);
      EXPECT_GE(found->sigma2, 0.49) << "what all samples share is known to 0.7 px";
      EXPECT_LT(found->sigma2, 0.6);
    }
  }
}

TEST(LineSearch, FindsEdgesOfEveryDirection) {
  for (int i = 0; i < 12; ++i) {
    const double angle = i * 0.5236 + 0.1;
    const Point middle(320.4, 239.7), half = 50.0 * Point(std::cos(angle), std::sin(angle));
    const Piece edge{middle - half, middle + half};
    const auto found = find(draw_edge(kCamera, edge), beside(edge, 2.6, -0.5));
    ASSERT_TRUE(found) << i;
    EXPECT_LT(distance(*found, edge), 0.2) << i;  // the largest of 24 ends; the noise gives each about 0.08
  }
}

TEST(LineSearch, FindsABlurredEdgeAndAnEdgeFarAway) {
  const auto blurred = find(draw_edge(kCamera, kAslant, 3.0, 1.6), beside(kAslant, -2.0));
  ASSERT_TRUE(blurred);
  EXPECT_LT(distance(*blurred, kAslant), 0.25);  // the same noise on half the slope
  const cv::Mat grey = draw_edge(kCamera, kAslant);
  const auto far = find(grey, beside(kAslant, 13.5, 2.0), 20.0);
  ASSERT_TRUE(far);
  EXPECT_LT(distance(*far, kAslant), 0.15);
  EXPECT_FALSE(find(grey, beside(kAslant, 8.0), 5.0)) << "beyond the radius";
}

TEST(LineSearch, AnEdgeThatIsBrightOnTheOtherSideIsAnother) {
  const cv::Mat grey = draw_edge(kCamera, {kAslant.end, kAslant.start});
  EXPECT_FALSE(find(grey, beside(kAslant, 1.0)));
}

TEST(LineSearch, AnEdgeOfAnotherContrastIsAnother) {
  const cv::Mat grey = draw_edge(kCamera, kAslant);
  ExpectedLine expected = beside(kAslant, 1.0);
  for (const auto& [contrast, right] :
       {std::pair(32.0F, true), std::pair(50.0F, true), std::pair(15.0F, false), std::pair(120.0F, false)}) {
    expected.contrast = contrast;
    EXPECT_EQ(find(grey, expected).has_value(), right) << contrast;
  }
  expected.contrast = 0.0F;
  EXPECT_TRUE(find(grey, expected)) << "not known";
}

TEST(LineSearch, ALineThatIsPartlyHiddenIsFoundWhereItShows) {
  const ImageLine line = image_line(kAslant.start, kAslant.end).value();
  const double hidden_from = 287.0;  // u: a third of the line
  const cv::Mat grey = draw(kCamera, [&](const Point& p) {
    return p.x() > hidden_from ? 30.0 : kDark + (kBright - kDark) * blurred_step(signed_distance(line, p));
  });
  const auto found = find(grey, beside(kAslant, 2.0));
  ASSERT_TRUE(found);
  EXPECT_LT(distance(*found, kAslant), 0.15);
  EXPECT_LT(found->end.x(), hidden_from + 1.0);
  EXPECT_GT(found->end.x(), hidden_from - 15.0);

  LineSearchOptions half;
  half.min_found = 0.45;
  const cv::Mat half_hidden = draw(kCamera, [&](const Point& p) {
    return p.x() > 265.0 ? 30.0 : kDark + (kBright - kDark) * blurred_step(signed_distance(line, p));
  });
  EXPECT_FALSE(find(half_hidden, beside(kAslant, 2.0))) << "less than min_found shows";
  const auto lenient = LineSearch(kCamera, half).find(half_hidden, beside(kAslant, 2.0), 5.0);
  ASSERT_TRUE(lenient);
  EXPECT_LT(distance(*lenient, kAslant), 0.25);  // half as long, half as many samples
}

TEST(LineSearch, OfTwoParallelEdgesItTakesNoneRatherThanTheWrongOne) {
  const ImageLine line = image_line(kAslant.start, kAslant.end).value();
  const auto stairs = [&](double second) {  // two steps up, 4 px apart
    return draw(kCamera, [&, second](const Point& p) {
      const double d = signed_distance(line, p);
      return kDark + (kBright - kDark) * blurred_step(d) + second * blurred_step(d - 4.0);
    });
  };
  for (const double offset : {-1.0, 0.0, 1.0, 2.0, 3.0}) {
    EXPECT_FALSE(find(stairs(kContrast), beside(kAslant, offset))) << "alike: " << offset;
    // One of a third of the contrast is no rival.
    const auto found = find(stairs(kContrast / 3.0), beside(kAslant, offset));
    ASSERT_TRUE(found) << offset;
    EXPECT_LT(distance(*found, kAslant), 0.5) << offset;  // it is pulled by its neighbour's slope
  }
}

TEST(LineSearch, ADarkStripeShowsTheEdgeOfTheRightSign) {
  const ImageLine line = image_line(kAslant.start, kAslant.end).value();
  const cv::Mat grey = draw(kCamera, [&](const Point& p) {  // down, then 5 px farther up again
    const double d = signed_distance(line, p);
    return kBright + (kBright - kDark) * (blurred_step(d) - blurred_step(d + 5.0));
  });
  for (const double offset : {-4.0, -2.0, 0.0, 2.0}) {
    const auto found = find(grey, beside(kAslant, offset));
    ASSERT_TRUE(found) << offset;
    EXPECT_LT(distance(*found, kAslant), 0.25) << offset;
  }
}

TEST(LineSearch, FindsNothingOnABlankImageAndHardlyEverOneInNoise) {
  const cv::Mat blank(480, 640, CV_8UC1, cv::Scalar(100));
  const cv::Mat noisy = draw(
      kCamera, [](const Point&) { return 100.0; }, 10.0);
  Random random(8);
  int found = 0;
  for (int i = 0; i < 500; ++i) {
    const double u = random.uniform(50, 590), v = random.uniform(50, 430), angle = random.uniform(0.0, 6.28);
    const Point middle(u, v), half = random.uniform(15, 45) * Point(std::cos(angle), std::sin(angle));
    const ExpectedLine expected{middle - half, middle + half, 12.0F};  // such steps are all over the noise
    EXPECT_FALSE(find(blank, expected));
    for (const double radius : {5.0, 15.0}) found += find(noisy, expected, radius) ? 1 : 0;
  }
  EXPECT_LE(found, 10);  // of 1000: some short rows of edges are straight by chance
}

TEST(LineSearch, AtTheBorderItUsesWhatIsInTheImage) {
  // From outside on the left, through the image.
  const Piece edge{{-60.0, 200.0}, {140.0, 220.0}};
  const auto found = find(draw_edge(kCamera, edge), beside(edge, 1.5));
  ASSERT_TRUE(found);
  EXPECT_LT(distance(*found, edge), 0.15);
  EXPECT_GE(found->start.x(), 0.0);

  const Piece along_border{{100.0, 2.0}, {300.0, 2.0}}, outside{{100.0, -40.0}, {300.0, -60.0}};
  const cv::Mat grey = draw_edge(kCamera, along_border);
  EXPECT_FALSE(find(grey, beside(along_border, 0.0))) << "no room for a window";
  EXPECT_FALSE(find(grey, beside(outside, 0.0)));
  EXPECT_FALSE(find(grey, beside({{1e7, 1e7}, {1e7 + 100.0, 1e7}}, 0.0)));
}

TEST(LineSearch, WhatMakesNoSenseIsNotFound) {
  const cv::Mat grey = draw_edge(kCamera, kAslant);
  const double nan = std::numeric_limits<double>::quiet_NaN(),
               infinity = std::numeric_limits<double>::infinity();
  const ExpectedLine good = beside(kAslant, 0.0);
  EXPECT_FALSE(find(grey, {kAslant.start, kAslant.start, kContrast})) << "no length";
  EXPECT_FALSE(find(grey, {kAslant.start, kAslant.start + Point(5.0, 4.6), kContrast})) << "too short";
  for (const double radius : {0.0, -3.0, nan}) EXPECT_FALSE(find(grey, good, radius)) << radius;
  EXPECT_TRUE(find(grey, good, infinity)) << "cut to the largest there is";
  for (const double bad : {nan, infinity}) {
    ExpectedLine broken = good;
    broken.end.x() = bad;
    EXPECT_FALSE(find(grey, broken));
  }
}

TEST(LineSearch, AStraightEdgeThatTheLensBendsIsFoundStraight) {
  for (const Piece& edge : {Piece{{60.3, 80.0}, {240.0, 40.5}}, Piece{{560.0, 300.0}, {600.2, 430.7}},
                            Piece{{40.5, 420.0}, {35.0, 300.0}}, Piece{{250.0, 255.0}, {390.0, 262.0}}}) {
    const cv::Mat grey = draw_edge(kBent, edge);
    for (const double offset : {-3.5, 1.2, 4.0}) {
      for (const double radius : {5.0, 15.0}) {
        const auto found = find(grey, beside(edge, offset, 0.7), radius, kBent);
        ASSERT_TRUE(found) << edge.start.transpose() << " " << offset << " " << radius;
        EXPECT_LT(distance(*found, edge), 0.2) << edge.start.transpose() << " " << offset << " " << radius;
      }
    }
  }
}

}  // namespace
}  // namespace ipl_slam
