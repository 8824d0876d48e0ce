#include "geometry/camera.hpp"

#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>

#include <ipl_slam/error.hpp>

namespace ipl_slam {
namespace {

// The first camera of the TUM RGB-D benchmark, as its authors calibrated it.
Camera tum1() {
  Camera camera;
  camera.name = "tum1";
  camera.fx = 517.306, camera.fy = 516.469, camera.cx = 318.643, camera.cy = 255.314;
  camera.k1 = 0.262383, camera.k2 = -0.953104, camera.p1 = -0.005358, camera.p2 = 0.002628,
  camera.k3 = 1.163314;
  return camera;
}

template <class F>
void for_each_pixel(const Camera& camera, int step, const F& f) {
  for (int v = 0; v < camera.height; v += step)
    for (int u = 0; u < camera.width; u += step) f(Eigen::Vector2d(u, v));
}

TEST(Camera, undistorting_a_distorted_pixel_gives_the_pixel_back_all_over_the_image) {
  const Camera camera = tum1();
  double worst = 0.0, moved = 0.0;
  for_each_pixel(camera, 1, [&](const Eigen::Vector2d& uv) {
    worst = std::max(worst, (camera.undistort(camera.distort(uv)) - uv).norm());
    moved = std::max(moved, (camera.distort(uv) - uv).norm());
  });
  EXPECT_LT(worst, 1e-6);  // the precision the header promises
  EXPECT_GT(moved, 5.0);   // and the distortion is not a small one
}

TEST(Camera, distorting_an_undistorted_pixel_gives_the_pixel_back_all_over_the_image) {
  const Camera camera = tum1();
  double worst = 0.0;
  for_each_pixel(camera, 1, [&](const Eigen::Vector2d& uv) {
    worst = std::max(worst, (camera.distort(camera.undistort(uv)) - uv).norm());
  });
  EXPECT_LT(worst, 1e-6);
}

TEST(Camera, undistortion_agrees_with_opencv) {
  const Camera camera = tum1();
  const cv::Matx33d k(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
  const cv::Vec<double, 5> coefficients(camera.k1, camera.k2, camera.p1, camera.p2, camera.k3);
  std::vector<cv::Point2d> pixels, expected;
  for_each_pixel(camera, 16, [&](const Eigen::Vector2d& uv) { pixels.emplace_back(uv.x(), uv.y()); });
  // OpenCV's own five fixed-point steps leave up to a pixel in the corners; it is given steps enough to
  // converge.
  cv::undistortPoints(pixels, expected, k, coefficients, cv::noArray(), k,
                      cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 500, 1e-12));
  double worst = 0.0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const Eigen::Vector2d uv = camera.undistort({pixels[i].x, pixels[i].y});
    worst = std::max(worst, (uv - Eigen::Vector2d(expected[i].x, expected[i].y)).norm());
  }
  EXPECT_LT(worst, 1e-6);
}

TEST(Camera, without_distortion_a_pixel_stays_the_very_same) {
  const Camera camera;
  const Eigen::Vector2d uv(12.25, 470.125);
  EXPECT_EQ(camera.undistort(uv), uv);
  EXPECT_EQ(camera.distort(uv), uv);
}

TEST(Camera, undistortion_far_outside_the_image_stays_finite) {
  const Camera camera = tum1();
  for (const double far : {-1e5, -2000.0, 3000.0, 1e7}) {
    EXPECT_TRUE(camera.undistort({far, 100.0}).allFinite()) << far;
    EXPECT_TRUE(camera.undistort({far, far}).allFinite()) << far;
  }
}

TEST(Camera, a_point_projects_to_the_pixel_it_is_unprojected_from) {
  const Camera camera = tum1();
  const Eigen::Vector2d uv(100.5, 300.25);
  EXPECT_LT((camera.project(camera.unproject(uv, 2.5)) - uv).norm(),
            1e-10);  // a few roundings of numbers near 500
  EXPECT_EQ(camera.unproject(uv, 2.5).z(), 2.5);
}

void expect_complaint_about(const std::string& field, const Camera& camera) {
  try {
    camera.check();
    ADD_FAILURE() << "no complaint about " << field;
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find(": " + field + " "), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find(camera.name), std::string::npos) << error.what();
  }
}

TEST(Camera, check_names_the_first_value_that_cannot_be) {
  EXPECT_NO_THROW(tum1().check());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto with = [](auto change) {
    Camera camera = tum1();
    change(camera);
    return camera;
  };
  expect_complaint_about("fx", with([](Camera& c) { c.fx = 0.0; }));
  expect_complaint_about("fy", with([&](Camera& c) { c.fy = nan; }));
  expect_complaint_about("cx", with([](Camera& c) { c.cx = -1.0; }));
  expect_complaint_about("cy", with([](Camera& c) { c.cy = 481.0; }));
  expect_complaint_about("width", with([](Camera& c) { c.width = 15; }));
  expect_complaint_about("height", with([](Camera& c) { c.height = 0; }));
  expect_complaint_about("k3", with([&](Camera& c) { c.k3 = nan; }));
  expect_complaint_about("depth_scale", with([](Camera& c) { c.depth_scale = 0.0; }));
}

}  // namespace
}  // namespace ipl_slam
