#include "tracking/motion_model.hpp"

#include <gtest/gtest.h>

#include "support/synthetic_world.hpp"

namespace ipl_slam {
namespace {

using namespace test;

// Rounding is all that separates prediction and truth where the motion is what the model assumes.
constexpr double kRounding = 1e-12;

// A camera that keeps its twist: a helix.
const Vector6d kVelocity = (Vector6d() << 0.4, -0.1, 0.6, 0.2, -0.5, 0.3).finished();
const SE3 kStart = camera_at({1.0, 2.0, 3.0}, 0.4, -0.2);
SE3 on_helix(double t) {
  return SE3::exp(kVelocity * t) * kStart;
}

TEST(MotionModel, StaysWhereItIsAfterOnePose) {
  MotionModel motion;
  motion.update(10.0, kStart);
  EXPECT_LT(pose_difference(motion.predict(10.5), kStart), kRounding);
}

TEST(MotionModel, GoesOnAsBefore) {
  MotionModel motion;
  motion.update(10.0, on_helix(0.0));
  motion.update(10.1, on_helix(0.1));
  EXPECT_LT(pose_difference(motion.predict(10.2), on_helix(0.2)), kRounding);
}

TEST(MotionModel, ADroppedFrameNeitherHalvesNorDoublesTheMotion) {
  MotionModel motion;
  motion.update(10.0, on_helix(0.0));
  motion.update(10.1, on_helix(0.1));
  EXPECT_LT(pose_difference(motion.predict(10.4), on_helix(0.4)), kRounding) << "a gap ahead";
  motion.update(10.4, on_helix(0.4));
  EXPECT_LT(pose_difference(motion.predict(10.43), on_helix(0.43)), kRounding) << "a gap behind";
}

TEST(MotionModel, TwoPosesOfTheSameTimeGiveNoVelocity) {
  MotionModel motion;
  motion.update(10.0, on_helix(0.0));
  motion.update(10.0, on_helix(0.1));
  const SE3 predicted = motion.predict(10.1);
  EXPECT_TRUE(predicted.translation().allFinite());
  EXPECT_LT(pose_difference(predicted, on_helix(0.1)), kRounding);
}

TEST(MotionModel, KeepsTheCamerasOwnVelocityWhenTheMapMoves) {
  MotionModel motion;
  motion.update(10.0, on_helix(0.0));
  motion.update(10.1, on_helix(0.1));
  const SE3 T_old_new = camera_at({3.0, -1.0, 0.5}, 1.0, 0.7);
  motion.rebase(on_helix(0.1) * T_old_new);
  EXPECT_LT(pose_difference(motion.last_pose(), on_helix(0.1) * T_old_new), kRounding);
  EXPECT_LT(pose_difference(motion.predict(10.2), on_helix(0.2) * T_old_new), kRounding);
}

TEST(MotionModel, StandsStillAfterAStopUntilTwoPosesFollow) {
  MotionModel motion;
  motion.update(10.0, on_helix(0.0));
  motion.update(10.1, on_helix(0.1));
  motion.stop();
  EXPECT_LT(pose_difference(motion.predict(10.2), on_helix(0.1)), kRounding);
  // Found again elsewhere: what lies between the two places is no velocity.
  motion.update(20.0, on_helix(0.9));
  EXPECT_LT(pose_difference(motion.predict(20.1), on_helix(0.9)), kRounding);
  motion.update(20.1, on_helix(1.0));
  EXPECT_LT(pose_difference(motion.predict(20.2), on_helix(1.1)), kRounding);
}

}  // namespace
}  // namespace ipl_slam
