#include "evaluation/relative_error.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include <ipl_slam/error.hpp>

#include "evaluation/made_trajectory.hpp"

namespace ipl_slam {
namespace {

using testing::kStep;
using testing::moved;
using testing::some_motion;
using testing::steady_motion;

constexpr double kRounding = 1e-12;
// An angle near zero comes from a quaternion's vector part, rounded at 1e-16 each step; degrees are 57 times
// radians.
constexpr double kAngleRounding = 1e-10;

TEST(RelativeError, OfTheSamePathInAnotherWorldFrameIsZero) {
  const Trajectory truth = steady_motion(40, 0.7, 25.0);
  const RpeResult rpe = relative_pose_error(truth, moved(some_motion(), truth), RpeDelta::seconds(1.0));
  EXPECT_NEAR(rpe.trans_max, 0.0, kRounding);
  EXPECT_NEAR(rpe.rot_max, 0.0, kAngleRounding);
}

TEST(RelativeError, OfATooFastEstimateIsTheExcessPerDelta) {
  const Trajectory truth = steady_motion(25, 1.0), estimate = steady_motion(25, 1.08);
  const RpeResult second = relative_pose_error(truth, estimate, RpeDelta::seconds(1.0));
  EXPECT_NEAR(second.trans_rmse, 0.08, kRounding);
  EXPECT_NEAR(second.trans_mean, 0.08, kRounding);
  EXPECT_NEAR(second.trans_std, 0.0, kRounding);
  EXPECT_NEAR(second.rot_max, 0.0, kAngleRounding);
  const RpeResult frame = relative_pose_error(truth, estimate, RpeDelta::frames(1.0));
  EXPECT_NEAR(frame.trans_rmse, 0.01, kRounding) << "an eighth of a second";
}

TEST(RelativeError, OfAPureRotationIsItsAngle) {
  const Trajectory truth = steady_motion(25, 0.0), estimate = steady_motion(25, 0.0, 16.0);
  const RpeResult second = relative_pose_error(truth, estimate, RpeDelta::seconds(1.0));
  EXPECT_NEAR(second.rot_rmse, 16.0, kAngleRounding);
  EXPECT_NEAR(second.rot_min, 16.0, kAngleRounding);
  EXPECT_NEAR(second.trans_max, 0.0, kRounding);
  EXPECT_NEAR(relative_pose_error(truth, estimate, RpeDelta::frames(1.0)).rot_median, 2.0, kAngleRounding);
}

// 25 poses, 8 a second. A pair that ends in the last pose is not used, as in the benchmark's script.
TEST(RelativeError, UsesEveryPairThatEndsBeforeTheLastPose) {
  const Trajectory truth = steady_motion(25, 1.0);
  EXPECT_EQ(relative_pose_error(truth, truth, RpeDelta::frames(1.0)).pairs, 23u);
  EXPECT_EQ(relative_pose_error(truth, truth, RpeDelta::seconds(1.0)).pairs, 16u);
}

// The estimate jumps aside by 0.5 m before pose 10: seen by the one frame-to-frame pair (9, 10) of 23 and by
// the pairs (2, 10) to (9, 17) of the 16 one second apart.
TEST(RelativeError, SeesAJumpInThePairsThatStraddleItOnly) {
  const Trajectory truth = steady_motion(25, 1.0);
  Trajectory estimate = truth;
  for (std::size_t i = 10; i < 25; ++i) {
    estimate[i].T_wc =
        SE3(Eigen::Quaterniond::Identity(), estimate[i].T_wc.translation() + Eigen::Vector3d(0, 0.5, 0));
  }
  const RpeResult frame = relative_pose_error(truth, estimate, RpeDelta::frames(1.0));
  EXPECT_NEAR(frame.trans_max, 0.5, kRounding);
  EXPECT_NEAR(frame.trans_rmse, 0.5 / std::sqrt(23.0), kRounding);
  EXPECT_NEAR(frame.trans_median, 0.0, kRounding);
  const RpeResult second = relative_pose_error(truth, estimate, RpeDelta::seconds(1.0));
  EXPECT_NEAR(second.trans_mean, 0.5 * 8.0 / 16.0, kRounding);
  EXPECT_NEAR(second.trans_std, 0.25, kRounding);
}

// Ground truth of poses 8 to 15 is missing: they are 1 to 4.5 intervals from what is left. Those up to 2
// intervals away are still compared, by the script's rule; 10 to 13 are not, and with them the pairs (9, 10)
// to (13, 14).
TEST(RelativeError, LeavesOutPairsWithoutGroundTruthNearby) {
  Trajectory truth = steady_motion(25, 1.0);
  const Trajectory estimate = truth;
  truth.erase(truth.begin() + 8, truth.begin() + 16);
  EXPECT_EQ(relative_pose_error(truth, estimate, RpeDelta::frames(1.0)).pairs, 23u - 5u);
}

TEST(RelativeError, TakesGroundTruthAtTheNearestTime) {
  const Trajectory truth = steady_motion(60, 1.0);
  Trajectory estimate = truth;
  for (StampedPose& pose : estimate) pose.timestamp += 0.4 * kStep;
  EXPECT_NEAR(relative_pose_error(truth, estimate, RpeDelta::seconds(1.0)).trans_max, 0.0, kRounding);
}

TEST(RelativeError, IsRefusedForTrajectoriesTooShortOrElsewhereInTime) {
  const Trajectory truth = steady_motion(25, 1.0);
  EXPECT_THROW((void)relative_pose_error(truth, steady_motion(3, 1.0), RpeDelta::seconds(1.0)), UserError);
  EXPECT_THROW((void)relative_pose_error(truth, {}, RpeDelta::frames(1.0)), UserError);
  EXPECT_THROW((void)relative_pose_error({}, truth, RpeDelta::frames(1.0)), UserError);
  Trajectory later = truth;
  for (StampedPose& pose : later) pose.timestamp += 1000.0;
  EXPECT_THROW((void)relative_pose_error(truth, later, RpeDelta::frames(1.0)), UserError);
}

}  // namespace
}  // namespace ipl_slam
