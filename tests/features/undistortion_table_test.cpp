#include "features/undistortion_table.hpp"

#include <algorithm>

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

Camera freiburg1(int width, int height) {
  Camera camera;
  camera.width = width, camera.height = height;
  camera.fx = 517.306408, camera.fy = 516.469215, camera.cx = 318.643040, camera.cy = 255.313989;
  camera.k1 = 0.262383, camera.k2 = -0.953104, camera.p1 = -0.005358, camera.p2 = 0.002628;
  camera.k3 = 1.163314;
  return camera;
}

TEST(UndistortionTable, agrees_with_the_camera_all_over_the_image) {
  for (const int width : {640, 637}) {
    const Camera camera = freiburg1(width, 480);
    const UndistortionTable table(camera);
    double worst = 0.0;
    for (double v = 0.0; v <= 479.0; v += 2.3) {
      for (double u = 0.0; u <= width - 1.0; u += 3.1) {
        const Eigen::Vector2d pixel(u, v);
        worst = std::max(worst, (table(pixel.cast<float>()).cast<double>() - camera.undistort(pixel)).norm());
      }
    }
    EXPECT_LT(worst, 0.04);
  }
}

TEST(UndistortionTable, continues_beyond_the_border) {
  const Camera camera = freiburg1(640, 480);
  const UndistortionTable table(camera);
  for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(-1.0, 200.0), Eigen::Vector2d(640.5, 480.5)}) {
    EXPECT_LT((table(pixel.cast<float>()).cast<double>() - camera.undistort(pixel)).norm(), 0.05);
  }
}

TEST(UndistortionTable, leaves_pixels_of_a_camera_without_distortion) {
  const UndistortionTable table((Camera()));
  EXPECT_EQ(table(Eigen::Vector2f(3.25F, 470.5F)), Eigen::Vector2f(3.25F, 470.5F));
}

}  // namespace
}  // namespace ipl_slam
