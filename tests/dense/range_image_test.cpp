#include "dense/range_image.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "dataset/synthetic/depth_sensor.hpp"

namespace ipl_slam {
namespace {

constexpr double kRawPerMetre = 5000.0;

std::uint16_t raw(double metres) {
  return static_cast<std::uint16_t>(std::lround(metres * kRawPerMetre));
}

cv::Mat wall(double metres) {
  return {480, 640, CV_16UC1, cv::Scalar(raw(metres))};
}

// Depth in metres of the plane n . p = d (n unit, camera frame).
cv::Mat plane(const Camera& camera, const Eigen::Vector3d& n, double d) {
  cv::Mat depth(camera.height, camera.width, CV_32FC1);
  for (int v = 0; v < depth.rows; ++v) {
    for (int u = 0; u < depth.cols; ++u) {
      const double z = d / n.dot(camera.unproject({u, v}, 1.0));
      depth.at<float>(v, u) = static_cast<float>(z > 0.0 && z < 13.0 ? z : 0.0);
    }
  }
  return depth;
}

double true_incidence(const Camera& camera, const Eigen::Vector3d& n, int u, int v) {
  return std::abs(n.dot(camera.unproject({u, v}, 1.0)));
}

int count(const cv::Mat& image) {
  return cv::countNonZero(image);
}

TEST(RangeImage, IsTheMeasuredDepthInMetresOnAPlainWall) {
  const Camera camera;
  const RangeImage range = make_range_image(wall(2.0), {}, camera, {});
  EXPECT_EQ(count(range.depth), 640 * 480);
  double low = 0.0, high = 0.0;
  cv::minMaxLoc(range.depth, &low, &high);
  EXPECT_NEAR(low, 2.0, 1e-6);
  EXPECT_NEAR(high, 2.0, 1e-6);
  cv::minMaxLoc(range.incidence, &low, &high);
  EXPECT_NEAR(low, 1.0, 1e-4);
  EXPECT_NEAR(high, 1.0, 1e-4);
  cv::minMaxLoc(range.reach, &low, &high);
  EXPECT_NEAR(low, 2.0, 1e-6);
  EXPECT_NEAR(high, 2.0, 1e-6);
}

TEST(RangeImage, KnowsTheSlantOfAFloorUnderADepthCamerasNoise) {
  const Camera camera;
  const Eigen::Vector3d n(0.0, std::cos(0.6), std::sin(0.6));  // a floor 1.4 m below a camera that looks down
  const cv::Mat truth = plane(camera, n, 1.4);
  cv::Mat cosine(truth.size(), CV_32FC1, cv::Scalar(1.0));
  const cv::Mat noisy = synthetic::measure_depth(truth, cosine, camera, {}, 5);
  const RangeImage range = make_range_image(synthetic::depth_to_raw(noisy, kRawPerMetre), {}, camera, {});
  double sum = 0.0, squares = 0.0;
  int pixels = 0;
  for (int v = 16; v < 464; v += 4) {
    for (int u = 16; u < 624; u += 4) {
      if (truth.at<float>(v, u) > 3.2F || range.depth.at<float>(v, u) == 0.0F) continue;
      const double error = range.incidence.at<float>(v, u) - true_incidence(camera, n, u, v);
      sum += error;
      squares += error * error;
      ++pixels;
    }
  }
  ASSERT_GT(pixels, 5000);
  // 4 degrees of error at an angle of 45 degrees change the cosine by 0.05.
  EXPECT_LT(std::sqrt(squares / pixels), 0.05);
  EXPECT_LT(std::abs(sum / pixels), 0.01);
}

TEST(RangeImage, KnowsTheSlantOfWallsInImagesOfAnySize) {
  Camera camera;
  camera.width = 317, camera.height = 243, camera.cx = 158.0, camera.cy = 121.0, camera.fx = 260.0,
  camera.fy = 263.0;
  const Eigen::Vector3d n = Eigen::Vector3d(-0.4, 0.2, 1.0).normalized();
  const cv::Mat depth = synthetic::depth_to_raw(plane(camera, n, 1.5), kRawPerMetre);
  const RangeImage range = make_range_image(depth, {}, camera, {});
  EXPECT_EQ(count(range.depth), 317 * 243);
  for (const auto& [u, v] : {std::pair{0, 0}, {316, 242}, {100, 50}, {3, 240}, {200, 121}}) {
    // Depth is rounded to 0.2 mm, the slope taken over 8 pixels of 6 mm at the least.
    EXPECT_NEAR(range.incidence.at<float>(v, u), true_incidence(camera, n, u, v), 0.01) << u << " " << v;
  }
}

TEST(RangeImage, LeavesOutBothSidesOfADepthStepByOnePixel) {
  cv::Mat depth = wall(3.0);
  depth.colRange(0, 300).setTo(raw(2.0));
  const RangeImage range = make_range_image(depth, {}, Camera(), {});
  for (int u : {297, 298, 301, 302}) EXPECT_GT(range.depth.at<float>(200, u), 0.0F) << u;
  for (int u : {299, 300}) EXPECT_EQ(range.depth.at<float>(200, u), 0.0F) << u;
  EXPECT_EQ(count(range.depth), 638 * 480);
  // The slant is that of the walls, up to the edge.
  for (int u : {296, 298, 301, 304}) EXPECT_NEAR(range.incidence.at<float>(200, u), 1.0F, 0.01) << u;
}

TEST(RangeImage, TakesAHoleForNoStep) {
  cv::Mat depth = wall(2.0);
  depth(cv::Rect(300, 200, 9, 5)).setTo(0);
  const RangeImage range = make_range_image(depth, {}, Camera(), {});
  EXPECT_EQ(count(range.depth), 640 * 480 - 45);
  EXPECT_EQ(count(range.reach), 640 * 480 - 45);
}

TEST(RangeImage, KnowsTheSlantBesideAStepThatAHoleHides) {
  // The projector's shadow, beside what stands 8 cm before the wall.
  cv::Mat depth = wall(1.0);
  depth.colRange(0, 297).setTo(raw(0.92));
  depth.colRange(297, 301).setTo(0);
  const RangeImage range = make_range_image(depth, {}, Camera(), {});
  EXPECT_EQ(count(range.depth), 636 * 480);
  for (int u : {284, 288, 292, 296, 301, 305, 309, 313}) {
    EXPECT_NEAR(range.incidence.at<float>(200, u), 1.0F, 0.01) << u;
  }
}

TEST(RangeImage, KeepsThinThings) {
  cv::Mat depth = wall(3.0);
  depth.colRange(400, 412).setTo(raw(2.0));  // 4.5 cm wide
  const RangeImage range = make_range_image(depth, {}, Camera(), {});
  EXPECT_EQ(count(range.depth.colRange(400, 412)), 10 * 480);
}

TEST(RangeImage, LeavesOutWhatIsFarMaskedOrSeenTooFlat) {
  const Camera camera;
  RangeOptions options;
  options.max_depth = 2.5;
  cv::Mat depth = wall(2.0);
  depth.rowRange(0, 100).setTo(raw(2.52));  // no edge: 1 % further
  depth.rowRange(100, 480).setTo(raw(2.48));
  cv::Mat left_out = cv::Mat::zeros(depth.size(), CV_8UC1);
  left_out.colRange(0, 50).setTo(255);
  const RangeImage range = make_range_image(depth, left_out, camera, options);
  EXPECT_EQ(count(range.depth), 590 * 380);
  EXPECT_EQ(count(range.incidence), 590 * 380);
  // They are measured for all that: rays go there, up to the greatest depth.
  EXPECT_EQ(count(range.reach), 640 * 480);
  EXPECT_NEAR(range.reach.at<float>(10, 10), 2.5F, 1e-6);
  EXPECT_NEAR(range.reach.at<float>(300, 10), 2.48F, 1e-6);

  options.min_incidence = 0.5;
  const Eigen::Vector3d flat(std::sin(1.2), 0.0, std::cos(1.2));
  const RangeImage wall_along =
      make_range_image(synthetic::depth_to_raw(plane(camera, flat, 0.5), kRawPerMetre), {}, camera, options);
  for (int u = 30; u < 610; u += 10) {
    const double cosine = true_incidence(camera, flat, u, 240) / camera.unproject({u, 240}, 1.0).norm();
    const float taken = wall_along.depth.at<float>(240, u);
    const bool is_near = flat.dot(camera.unproject({u, 240}, 1.0)) > 0.25;  // within 2 m
    if (cosine > 0.48 && (cosine < 0.52 || !is_near)) continue;
    EXPECT_EQ(taken > 0.0F, cosine > 0.5) << u;
  }
}

TEST(RangeImage, ReachesAsFarAsTheNearestDepthAroundAPixel) {
  cv::Mat depth = wall(3.0);
  depth.at<std::uint16_t>(100, 100) = raw(1.0);
  depth.at<std::uint16_t>(101, 101) = 0;
  const RangeImage range = make_range_image(depth, {}, Camera(), {});
  EXPECT_FLOAT_EQ(range.reach.at<float>(100, 100), 1.0F);
  EXPECT_FLOAT_EQ(range.reach.at<float>(102, 98), 1.0F);
  EXPECT_FLOAT_EQ(range.reach.at<float>(103, 98), 3.0F);
  EXPECT_FLOAT_EQ(range.reach.at<float>(100, 103), 3.0F);
  EXPECT_EQ(range.reach.at<float>(101, 101), 0.0F);
}

TEST(RangeImage, HasNothingWhereNothingWasMeasured) {
  const RangeImage range = make_range_image(wall(0.0), {}, Camera(), {});
  EXPECT_EQ(count(range.depth) + count(range.incidence) + count(range.reach), 0);
}

TEST(RangeImage, RefusesImagesOfAnotherSizeOrType) {
  EXPECT_THROW(static_cast<void>(make_range_image(cv::Mat(480, 640, CV_32FC1), {}, Camera(), {})),
               cv::Exception);
  EXPECT_THROW(static_cast<void>(make_range_image(wall(1.0)(cv::Rect(0, 0, 320, 240)), {}, Camera(), {})),
               cv::Exception);
  EXPECT_THROW(static_cast<void>(make_range_image(wall(1.0), cv::Mat::zeros(10, 10, CV_8UC1), Camera(), {})),
               cv::Exception);
}

// --- smoothing ---

// RMS error of depth against the truth, m, over pixels that were taken in.
double depth_error(const RangeImage& range, const cv::Mat& truth, const cv::Rect& where) {
  double squares = 0.0;
  int pixels = 0;
  for (int v = where.y; v < where.br().y; ++v) {
    for (int u = where.x; u < where.br().x; ++u) {
      const float measured = range.depth.at<float>(v, u);
      if (measured == 0.0F) continue;
      squares += std::pow(measured - truth.at<float>(v, u), 2);
      ++pixels;
    }
  }
  EXPECT_GT(pixels, where.area() / 2);
  return std::sqrt(squares / pixels);
}

RangeImage smoothed(const cv::Mat& metres, const Camera& camera, double detail) {
  RangeOptions options;
  options.detail = detail;
  return make_range_image(synthetic::depth_to_raw(metres, kRawPerMetre), {}, camera, options);
}

constexpr double kNoSmoothing = 1.0, kDefaultDetail = 0.005;  // m

TEST(RangeImage, SmoothsTheNoiseOfWhatIsFarAway) {
  const Camera camera;
  const cv::Mat truth = plane(camera, Eigen::Vector3d(0.3, 0.2, 1.0).normalized(), 3.4);
  synthetic::DepthSensorOptions sensor;
  sensor.disparity_step = 0.0;  // noise that differs from pixel to pixel
  const cv::Mat noisy =
      synthetic::measure_depth(truth, cv::Mat(truth.size(), CV_32FC1, cv::Scalar(1.0)), camera, sensor, 7);
  const cv::Rect middle(200, 150, 240, 180);
  const double before = depth_error(smoothed(noisy, camera, kNoSmoothing), truth, middle),
               after = depth_error(smoothed(noisy, camera, kDefaultDetail), truth, middle);
  EXPECT_GT(before, 0.010);
  EXPECT_LT(after, 0.5 * before);  // 16 pixels have a quarter of the noise of one, some of which is kept
}

TEST(RangeImage, KeepsTheDetailOfWhatIsNear) {
  const Camera camera;
  cv::Mat depth = plane(camera, Eigen::Vector3d(0, 0, 1), 0.8);
  const cv::Rect ridge(320, 0, 1, 480);
  depth(ridge).setTo(0.803F);  // 3 mm, three times the noise there
  const RangeImage range = smoothed(depth, camera, kDefaultDetail);
  EXPECT_NEAR(range.depth.at<float>(240, 320), 0.803, 2e-4);
  EXPECT_NEAR(range.depth.at<float>(240, 300), 0.800, 2e-4);
}

TEST(RangeImage, IsNotBentAtTheRimOfAHoleInASlantedFloor) {
  const Camera camera;
  const Eigen::Vector3d n(0.0, std::cos(0.25), std::sin(0.25));  // seen flat: 4 cm of depth per row at 3 m
  const cv::Mat truth = plane(camera, n, 1.4);
  cv::Mat holed = truth.clone();
  for (int v = 0; v < holed.rows; v += 8) holed.rowRange(v, v + 2).setTo(0.0F);  // half of every second cell
  const RangeImage range = smoothed(holed, camera, kDefaultDetail);
  double sum = 0.0;
  int pixels = 0;
  for (int v = 0; v < holed.rows; ++v) {
    for (int u = 200; u < 440; ++u) {
      const float measured = range.depth.at<float>(v, u), true_depth = truth.at<float>(v, u);
      if (measured == 0.0F || v % 8 > 3 || true_depth < 2.5F || true_depth > 3.5F) continue;
      sum += measured - true_depth;
      ++pixels;
    }
  }
  ASSERT_GT(pixels, 100);
  EXPECT_LT(std::abs(sum / pixels), 0.002);
}

}  // namespace
}  // namespace ipl_slam
