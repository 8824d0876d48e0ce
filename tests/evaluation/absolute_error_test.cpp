#include "evaluation/absolute_error.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ipl_slam/error.hpp>

#include "evaluation/made_trajectory.hpp"

namespace ipl_slam {
namespace {

using ::testing::AllOf;
using testing::cross;
using ::testing::HasSubstr;
using testing::moved;
using testing::some_motion;
using testing::steady_motion;
using testing::trajectory_of;

// Rounding of a few additions of numbers around 10.
constexpr double kRounding = 1e-12;

TEST(AbsoluteError, IsZeroInWhateverWorldFrameTheEstimateIs) {
  const Trajectory truth = trajectory_of({{0, 0, 0}, {1, 0, 0}, {1, 2, 0}, {1, 2, 3}});
  const AteResult ate = absolute_trajectory_error(truth, moved(some_motion(), truth));
  EXPECT_EQ(ate.pairs, 4u);
  EXPECT_NEAR(ate.max, 0.0, kRounding);
  const SE3 residual = ate.T_ge * some_motion();
  EXPECT_NEAR(residual.log().norm(), 0.0, kRounding)
      << "the alignment takes the estimate's world to the truth's";
}

// Errors 0.1, 0.1, 0.2, 0.2: see cross(). That they are not zero shows that no scale is fitted.
TEST(AbsoluteError, OfAScaledPathHasTheFiguresComputedByHand) {
  const AteResult ate = absolute_trajectory_error(cross(1.0), moved(some_motion(), cross(1.1)));
  EXPECT_NEAR(ate.rmse, 0.1 * std::sqrt(2.5), kRounding);
  EXPECT_NEAR(ate.mean, 0.15, kRounding);
  EXPECT_NEAR(ate.median, 0.15, kRounding);
  EXPECT_NEAR(ate.std, 0.05, kRounding);
  EXPECT_NEAR(ate.min, 0.1, kRounding);
  EXPECT_NEAR(ate.max, 0.2, kRounding);
}

// Corners of a square, moved out of its plane by turns: no rotation or shift takes any of it away.
TEST(AbsoluteError, OfAKnownOffsetAtEveryPoseIsThatOffset) {
  const Trajectory truth = trajectory_of({{1, 1, 0}, {-1, 1, 0}, {-1, -1, 0}, {1, -1, 0}});
  const Trajectory estimate = trajectory_of({{1, 1, 0.03}, {-1, 1, -0.03}, {-1, -1, 0.03}, {1, -1, -0.03}});
  const AteResult ate = absolute_trajectory_error(truth, estimate);
  EXPECT_NEAR(ate.rmse, 0.03, kRounding);
  EXPECT_NEAR(ate.std, 0.0, kRounding);
  for (const AlignedPair& pair : ate.aligned) EXPECT_NEAR(pair.error(), 0.03, kRounding);
}

// A tetrahedron and its mirror image -p. The best proper rotation is half a turn: of 4 * 3 * 2 = 24 only 8
// are gained, which leaves 16 / 4 in the mean square.
TEST(AbsoluteError, OfAMirroredPathIsNotAlignedByMirroring) {
  const std::vector<Eigen::Vector3d> corners = {{1, 1, 1}, {-1, -1, 1}, {-1, 1, -1}, {1, -1, -1}};
  std::vector<Eigen::Vector3d> mirrored;
  for (const Eigen::Vector3d& p : corners) mirrored.emplace_back(-p);
  EXPECT_NEAR(absolute_trajectory_error(trajectory_of(corners), trajectory_of(mirrored)).rmse, 2.0,
              kRounding);
}

TEST(AbsoluteError, OfACameraThatOnlyTurnsIsZero) {
  const AteResult ate =
      absolute_trajectory_error(steady_motion(10, 0.0, 30.0), steady_motion(10, 0.0, -50.0));
  EXPECT_EQ(ate.pairs, 10u);
  EXPECT_NEAR(ate.max, 0.0, kRounding);
}

TEST(AbsoluteError, OfACameraThatIsTakenForStillIsTheSpreadOfItsPath) {
  const AteResult ate =
      absolute_trajectory_error(cross(1.0), trajectory_of(std::vector<Eigen::Vector3d>(4, {5, 5, 5})));
  EXPECT_NEAR(ate.rmse, std::sqrt(2.5), kRounding);
  EXPECT_TRUE(std::isfinite(ate.T_ge.log().norm()));
}

TEST(AbsoluteError, OfAStraightPathIsZero) {
  const Trajectory truth = steady_motion(20, 1.0);
  EXPECT_NEAR(absolute_trajectory_error(truth, moved(some_motion(), truth)).max, 0.0, kRounding);
}

TEST(AbsoluteError, ComparesOnlyPosesThatHaveGroundTruth) {
  Trajectory estimate = cross(1.0);
  estimate.insert(estimate.begin(), {99.0, SE3(Eigen::Quaterniond::Identity(), {50, 0, 0})});
  estimate.push_back({200.0, SE3()});
  const AteResult ate = absolute_trajectory_error(cross(1.0), estimate);
  EXPECT_EQ(ate.pairs, 4u);
  EXPECT_EQ(ate.estimated_poses, 6u);
  EXPECT_EQ(ate.ground_truth_poses, 4u);
  EXPECT_NEAR(ate.max, 0.0, kRounding);
}

// 81 poses are 10 s. Poses 30 to 49 are lost, which opens a gap from pose 29 to pose 50: 21 steps of 0.125 s.
TEST(AbsoluteError, TellsTheShareOfTimeForWhichThereArePoses) {
  const Trajectory truth = steady_motion(81, 1.0);
  EXPECT_NEAR(absolute_trajectory_error(truth, truth).coverage, 1.0, kRounding);
  Trajectory estimate = truth;
  estimate.erase(estimate.begin() + 30, estimate.begin() + 50);
  EXPECT_NEAR(absolute_trajectory_error(truth, estimate).coverage, 1.0 - 21.0 / 80.0, kRounding);
  estimate.resize(11);
  EXPECT_NEAR(absolute_trajectory_error(truth, estimate).coverage, 10.0 / 80.0, kRounding);
}

TEST(AbsoluteError, IsRefusedForLessThanThreePairs) {
  Trajectory estimate = cross(1.0);
  for (StampedPose& pose : estimate) pose.timestamp += 1000.0;
  std::string message;
  try {
    (void)absolute_trajectory_error(cross(1.0), estimate);
  } catch (const UserError& error) {
    message = error.what();
  }
  EXPECT_THAT(message, AllOf(HasSubstr("only 0 poses"), HasSubstr("100.000000 to 100.375000 s"),
                             HasSubstr("1100.000000 to 1100.375000 s")));
  EXPECT_THROW((void)absolute_trajectory_error(cross(1.0), {estimate[0]}), UserError);
  EXPECT_THROW((void)absolute_trajectory_error({}, {}), UserError);
}

}  // namespace
}  // namespace ipl_slam
