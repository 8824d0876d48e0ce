#include "tracking/visibility.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "map/local_map.hpp"
#include "support/synthetic_world.hpp"

namespace ipl_slam {
namespace {

using namespace test;

constexpr double kDegree = std::numbers::pi / 180.0;
const Visibility kVisibility(kTestCamera, kTestPyramid);

// A landmark on the optical axis of the identity camera, seen from there before.
LocalPoint landmark(const Eigen::Vector3d& position = {0.0, 0.0, 2.0}) {
  LocalPoint point{};
  point.position = position;
  point.normal = position.normalized();
  point.max_distance = 4.0;
  point.min_distance = 4.0 / kTestPyramid.scale(7);
  return point;
}

bool visible(const SE3& T_cw, const LocalPoint& point) {
  return kVisibility.project(T_cw, point, 3.0).has_value();
}

TEST(Visibility, PutsAWindowWhereALandmarkInFrontProjects) {
  const LocalPoint point = landmark({0.2, -0.1, 2.0});
  const auto window = kVisibility.project(SE3{}, point, 3.0);
  ASSERT_TRUE(window);
  EXPECT_NEAR(window->uv.x(), 319.5 + 525.0 * 0.1, 1e-4);  // float
  EXPECT_NEAR(window->uv.y(), 239.5 - 525.0 * 0.05, 1e-4);
  EXPECT_FLOAT_EQ(window->depth, 2.0F);
  EXPECT_EQ(window->descriptor, &point.descriptor);
  EXPECT_LT(window->angle, 0.0F) << "a landmark says nothing about the camera's roll";
}

TEST(Visibility, SeesNothingBehindOrAtTheCamera) {
  const LocalPoint point = landmark();
  EXPECT_FALSE(visible(camera_at({0.0, 0.0, 4.0}), point));
  EXPECT_FALSE(visible(camera_at({0.0, 0.0, 2.0}), point));
  EXPECT_FALSE(visible(camera_at({0.0, 0.0, 1.96}), point));
}

TEST(Visibility, EndsAtTheBorderOfTheImage) {
  // Pixel centres reach from 0 to 639 and from 0 to 479.
  const auto at = [](double u, double v) { return landmark(kTestCamera.unproject({u, v}, 2.0)); };
  EXPECT_TRUE(visible(SE3{}, at(0.01, 0.01)));
  EXPECT_TRUE(visible(SE3{}, at(638.99, 478.99)));
  EXPECT_FALSE(visible(SE3{}, at(-0.01, 100.0)));
  EXPECT_FALSE(visible(SE3{}, at(639.01, 100.0)));
  EXPECT_FALSE(visible(SE3{}, at(100.0, -0.01)));
  EXPECT_FALSE(visible(SE3{}, at(100.0, 479.01)));
}

TEST(Visibility, TheBorderIsThatOfTheUndistortedImage) {
  Camera camera = kTestCamera;
  camera.k1 = 0.25;
  const Visibility visibility(camera, kTestPyramid);
  // Every pixel of the real image is inside once undistorted.
  for (double u = 0.0; u <= 639.0; u += 21.3) {
    for (double v = 0.0; v <= 479.0; v += 47.9) {
      const bool border = u == 0.0 || v == 0.0;
      const Eigen::Vector2d uv = camera.undistort({u, v});
      EXPECT_TRUE(visibility.inside(uv)) << u << " " << v << (border ? " on the border" : "");
    }
  }
  // A positive k1 pulls the undistorted corners inwards.
  EXPECT_TRUE(kVisibility.inside({1.0, 1.0}));
  EXPECT_FALSE(visibility.inside({1.0, 1.0}));
}

TEST(Visibility, KeepsToThePyramidsRangeOfDistancesAndOneLevelMore) {
  const LocalPoint point = landmark();
  const auto from = [&](double distance) { return visible(camera_at({0.0, 0.0, 2.0 - distance}), point); };
  const double farthest = 1.2 * point.max_distance, nearest = point.min_distance / 1.2;
  EXPECT_TRUE(from(0.99 * farthest));
  EXPECT_FALSE(from(1.01 * farthest));
  EXPECT_TRUE(from(1.01 * nearest));
  EXPECT_FALSE(from(0.99 * nearest));
}

TEST(Visibility, SeesALandmarkFromUpToSixtyDegreesAside) {
  const LocalPoint point = landmark();
  // On a circle around the landmark, looking at it.
  const auto from = [&](double angle) {
    const Eigen::Vector3d position(-2.0 * std::sin(angle), 0.0, 2.0 - 2.0 * std::cos(angle));
    return visible(camera_at(position, angle), point);
  };
  EXPECT_TRUE(from(0.0));
  EXPECT_TRUE(from(59.0 * kDegree));
  EXPECT_FALSE(from(61.0 * kDegree));
  EXPECT_TRUE(from(-59.0 * kDegree));
  EXPECT_FALSE(from(-61.0 * kDegree));
}

TEST(Visibility, ExpectsACoarserLevelFromNearer) {
  const LocalPoint point = landmark();
  int last_level = -1;
  for (const double distance : {3.9, 3.0, 2.0, 1.5, 1.2}) {
    const auto window = kVisibility.project(camera_at({0.0, 0.0, 2.0 - distance}), point, 3.0);
    ASSERT_TRUE(window);
    // The level on which the patch has the size it has on level 0 from max_distance, rounded up.
    const int level = static_cast<int>(std::ceil(std::log(4.0 / distance) / std::log(1.2)));
    EXPECT_EQ(window->max_level, level);
    EXPECT_EQ(window->min_level, level - 1);
    EXPECT_FLOAT_EQ(window->radius, static_cast<float>(3.0 * std::pow(1.2, level)));
    EXPECT_GT(level, last_level);
    last_level = level;
  }
}

TEST(Visibility, TheLevelStaysWithinThePyramid) {
  const LocalPoint point = landmark();
  const auto far = kVisibility.project(camera_at({0.0, 0.0, 2.0 - 4.5}), point, 3.0);
  ASSERT_TRUE(far);
  EXPECT_EQ(far->max_level, 0);
  const auto near = kVisibility.project(camera_at({0.0, 0.0, 2.0 - 0.95}), point, 3.0);
  ASSERT_TRUE(near);
  EXPECT_EQ(near->max_level, 7);
}

TEST(Visibility, APoseThatIsNotANumberShowsNothing) {
  const double nan = std::nan("");
  EXPECT_FALSE(visible(SE3(Eigen::Quaterniond::Identity(), {nan, nan, nan}), landmark()));
}

}  // namespace
}  // namespace ipl_slam
