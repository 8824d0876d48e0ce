#include "dense/viewpoint.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "common/random.hpp"

namespace ipl_slam {
namespace {

// A box of 4 x 2 x 1 m about (1, 2, 0.5), full of points, in a world with z up.
SemanticCloud box() {
  SemanticCloud cloud;
  Random random(1);
  for (int i = 0; i < 5000; ++i) {
    CloudPoint point;
    point.position =
        Eigen::Vector3d(random.uniform(-1, 3), random.uniform(1, 3), random.uniform(0, 1)).cast<float>();
    cloud.points.push_back(point);
  }
  return cloud;
}

Eigen::Vector2d pixel(const Viewpoint& view, const Eigen::Vector3d& p_w) {
  const Eigen::Vector3d p = view.T_vw * p_w;
  const double scale = view.orthographic ? view.scale : view.scale / p.z();
  return {scale * p.x() + 0.5 * view.size.width, scale * p.y() + 0.5 * view.size.height};
}

bool is_inside(const Viewpoint& view, const Eigen::Vector3d& p_w) {
  const Eigen::Vector2d uv = pixel(view, p_w);
  return uv.x() >= 0 && uv.x() < view.size.width && uv.y() >= 0 && uv.y() < view.size.height &&
         (view.T_vw * p_w).z() > 0;
}

TEST(TopView, HasXToTheRightAndYUp) {
  const Viewpoint view = top_view(box(), {}, {800, 600});
  const Eigen::Vector2d middle = pixel(view, {1, 2, 0.5});
  EXPECT_NEAR(middle.x(), 400, 4);
  EXPECT_NEAR(middle.y(), 300, 4);
  EXPECT_GT(pixel(view, {2, 2, 0.5}).x(), middle.x() + 100);
  EXPECT_LT(pixel(view, {1, 3, 0.5}).y(), middle.y() - 100);
  EXPECT_LT((view.T_vw * Eigen::Vector3d(1, 2, 1)).z(), (view.T_vw * Eigen::Vector3d(1, 2, 0)).z())
      << "from above";
}

TEST(TopView, IsNotMisledByStrays) {
  SemanticCloud cloud = box();
  const double scale = top_view(cloud, {}, {800, 600}).scale;
  for (int i = 0; i < 10; ++i) cloud.points[static_cast<std::size_t>(i)].position.x() = 500.0F;
  EXPECT_NEAR(top_view(cloud, {}, {800, 600}).scale, scale, 0.02 * scale);
}

TEST(OrbitView, ShowsAllOfItAndFillsThePicture) {
  const SemanticCloud cloud = box();
  for (const double azimuth : {0.0, 77.0, 180.0, 290.0}) {
    for (const double elevation : {-90.0, -20.0, 0.0, 35.0, 90.0}) {
      const Viewpoint view = orbit_view(cloud, {}, azimuth, elevation, {800, 600});
      std::size_t inside = 0;
      double reach = 0.0;
      for (const CloudPoint& point : cloud.points) {
        inside += is_inside(view, point.position.cast<double>()) ? 1 : 0;
        const Eigen::Vector2d uv = pixel(view, point.position.cast<double>());
        reach = std::max({reach, std::abs(uv.x() / 400 - 1), std::abs(uv.y() / 300 - 1)});
      }
      EXPECT_GT(inside, cloud.points.size() * 998 / 1000) << azimuth << " " << elevation;
      EXPECT_GT(reach, 0.85) << azimuth << " " << elevation;
    }
  }
}

TEST(OrbitView, LooksFromTheSideThatIsAskedFor) {
  // From azimuth 0 the viewer is on the x side and looks along -x; y is on the right, z up.
  const Viewpoint view = orbit_view(box(), {}, 0.0, 0.0, {800, 600});
  const Eigen::Vector3d eye = view.T_vw.inverse().translation();
  EXPECT_GT(eye.x(), 3.0);
  EXPECT_NEAR(eye.y(), 2.0, 0.05);
  EXPECT_GT(pixel(view, {1, 2.5, 0.5}).x(), pixel(view, {1, 1.5, 0.5}).x());
  EXPECT_LT(pixel(view, {1, 2, 0.9}).y(), pixel(view, {1, 2, 0.1}).y());
  EXPECT_GT(orbit_view(box(), {}, 0.0, 40.0, {800, 600}).T_vw.inverse().translation().z(), 1.0);
  EXPECT_GT(orbit_view(box(), {}, 90.0, 0.0, {800, 600}).T_vw.inverse().translation().y(), 3.0);
}

TEST(TrajectoryView, ShowsTheCameraFromBehindAndAbove) {
  // A camera in an upright world, 1 m up, that looks along y and leans.
  Eigen::Matrix3d R;
  R << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  const SE3 leaning(Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ())),
                    Eigen::Vector3d::Zero());
  const SE3 T_wc = SE3(R, {2, 3, 1}) * leaning;
  const Viewpoint view = trajectory_view(T_wc, {}, {800, 600});
  const Eigen::Vector3d eye = view.T_vw.inverse().translation();
  EXPECT_LT(eye.y(), 3.0);
  EXPECT_GT(eye.z(), 1.0);
  EXPECT_TRUE(is_inside(view, T_wc.translation()));
  EXPECT_NEAR(pixel(view, {2, 3, 1}).x(), pixel(view, {2, 3, 1.5}).x(), 1e-6)
      << "level, though the camera leans";
  // Straight down nothing is level; it must still be a pose.
  const SE3 down(Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX())),
                 Eigen::Vector3d(0, 0, 3));
  EXPECT_TRUE(trajectory_view(down, {}, {800, 600}).T_vw.translation().allFinite());
}

}  // namespace
}  // namespace ipl_slam
