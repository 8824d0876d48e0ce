#include "tracking/line_visibility.hpp"

#include <limits>

#include <gtest/gtest.h>

#include "support/synthetic_world.hpp"

namespace ipl_slam {
namespace {

using test::kTestCamera;
using Point = Eigen::Vector3d;

const LineVisibility kVisibility(kTestCamera);

Point at(double u, double v, double z) {
  return kTestCamera.unproject({u, v}, z);
}

TEST(LineVisibility, APieceInFrontShowsFromItsStartToItsEnd) {
  const SE3 T_cw = SE3::exp((Vector6d() << 0.3, -0.2, 0.5, 0.2, -0.4, 1.0).finished());
  const SE3 T_wc = T_cw.inverse();
  const auto part = kVisibility.visible_part(T_cw, T_wc * at(100, 50, 2), T_wc * at(500, 400, 4));
  ASSERT_TRUE(part);
  EXPECT_LT((part->first - Eigen::Vector2d(100, 50)).norm(), 1e-9);
  EXPECT_LT((part->second - Eigen::Vector2d(500, 400)).norm(), 1e-9);
}

TEST(LineVisibility, NothingShowsOfWhatLiesBehindTheCamera) {
  EXPECT_FALSE(kVisibility.visible_part(SE3{}, Point(-1, 0, -2), Point(1, 0, -2)));
  EXPECT_FALSE(kVisibility.visible_part(SE3{}, Point(-1, 0, 0), Point(1, 0, 0)));
  // Before the camera, but nearer than any camera sees.
  EXPECT_FALSE(kVisibility.visible_part(SE3{}, Point(-1, 0, 0.04), Point(1, 0, 0.04)));
}

TEST(LineVisibility, APieceThatPassesTheCameraIsCutBeforeIt) {
  // From 2 m before the camera to 2 m behind it, 10 cm below the optical axis.
  const Point ahead(0, 0.1, 2), behind(0, 0.1, -2);
  const auto part = kVisibility.visible_part(SE3{}, ahead, behind);
  ASSERT_TRUE(part);
  EXPECT_LT((part->first - kTestCamera.project(ahead)).norm(), 1e-9);
  EXPECT_NEAR(part->second.x(), 319.5, 1e-9);
  EXPECT_NEAR(part->second.y(), 479.0, 1e-9);  // it leaves the image below
  const auto reversed = kVisibility.visible_part(SE3{}, behind, ahead);
  ASSERT_TRUE(reversed);
  EXPECT_LT((reversed->first - part->second).norm() + (reversed->second - part->first).norm(), 1e-9);
}

TEST(LineVisibility, ThePartNearTheCameraIsWhereThePieceReachesFiveCentimetres) {
  // Slowly towards the axis, so that it is still in the image when it comes too near.
  const Point ahead(0.02, 0, 1), near(0.01, 0, 0.05);
  const Point along = near - ahead;
  const auto part = kVisibility.visible_part(SE3{}, ahead, ahead + 2.0 * along);
  ASSERT_TRUE(part);
  EXPECT_LT((part->second - kTestCamera.project(near)).norm(), 1e-6);
}

TEST(LineVisibility, APieceIsCutAtTheBordersOfTheImage) {
  const auto part = kVisibility.visible_part(SE3{}, at(-300, 100, 2), at(900, 100, 2));
  ASSERT_TRUE(part);
  EXPECT_LT((part->first - Eigen::Vector2d(0, 100)).norm(), 1e-9);
  EXPECT_LT((part->second - Eigen::Vector2d(639, 100)).norm(), 1e-9);

  const auto corner = kVisibility.visible_part(SE3{}, at(-100, 50, 2), at(100, -150, 2));
  EXPECT_FALSE(corner) << "passes outside the corner";
  const auto within = kVisibility.visible_part(SE3{}, at(-100, 150, 2), at(200, -150, 2));
  ASSERT_TRUE(within);
  EXPECT_LT((within->first - Eigen::Vector2d(0, 50)).norm(), 1e-9);
  EXPECT_LT((within->second - Eigen::Vector2d(50, 0)).norm(), 1e-9);
}

TEST(LineVisibility, ALineOnTheBorderShowsAndOneBesideItDoesNot) {
  EXPECT_TRUE(kVisibility.visible_part(SE3{}, at(100, 1e-6, 2), at(500, 1e-6, 2)));
  EXPECT_FALSE(kVisibility.visible_part(SE3{}, at(100, -0.01, 2), at(500, -0.01, 2)));
  EXPECT_FALSE(kVisibility.visible_part(SE3{}, at(639.01, 100, 2), at(639.01, 300, 2)));
}

TEST(LineVisibility, ALineSeenEndOnShowsNothing) {
  EXPECT_FALSE(kVisibility.visible_part(SE3{}, at(200, 300, 1), at(200, 300, 5)));
  EXPECT_FALSE(kVisibility.visible_part(SE3{}, at(200, 300, 1), at(200.9, 300, 5))) << "less than a pixel";
  EXPECT_TRUE(kVisibility.visible_part(SE3{}, at(200, 300, 1), at(201.1, 300, 5)));
}

TEST(LineVisibility, APieceWithoutLengthShowsNothing) {
  EXPECT_FALSE(kVisibility.visible_part(SE3{}, at(200, 300, 2), at(200, 300, 2)));
  EXPECT_FALSE(kVisibility.visible_part(SE3{}, Point::Zero(), Point::Zero()));
}

TEST(LineVisibility, NumbersThatAreNoneShowNothing) {
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    for (int axis = 0; axis < 3; ++axis) {
      Point broken = at(200, 300, 2);
      broken[axis] = bad;
      EXPECT_FALSE(kVisibility.visible_part(SE3{}, broken, at(400, 300, 2))) << axis;
      EXPECT_FALSE(kVisibility.visible_part(SE3{}, at(400, 300, 2), broken)) << axis;
    }
  }
}

TEST(LineVisibility, TheBorderIsThatOfTheUndistortedImage) {
  Camera camera = kTestCamera;
  camera.k1 = -0.25;  // the undistorted image is wider than the real one
  const LineVisibility wide(camera);
  const Point start = at(-30, 240, 2), end = at(300, 240, 2);
  const auto cut = kVisibility.visible_part(SE3{}, start, end), whole = wide.visible_part(SE3{}, start, end);
  ASSERT_TRUE(cut && whole);
  EXPECT_NEAR(cut->first.x(), 0.0, 1e-9);
  EXPECT_NEAR(whole->first.x(), -30.0, 1e-9);
  EXPECT_GT(camera.distort(whole->first).x(), 0.0) << "it does lie in the image";
}

}  // namespace
}  // namespace ipl_slam
