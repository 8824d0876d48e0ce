#include "segmentation/free_space.hpp"

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

constexpr double kTolerance = 0.03;

class AWallSeenFromTheSamePlace : public testing::Test {
 protected:
  [[nodiscard]] FreeSpaceEvidence judged(float depth) const {
    FreeSpaceEvidence evidence(grid_.size());
    view_.judge(grid_, at(depth), SE3(), evidence);
    return evidence;
  }
  [[nodiscard]] cv::Mat at(float depth) const { return {grid_.size(), CV_32FC1, cv::Scalar(1.0 / depth)}; }

  WorkingGrid grid_{Camera(), 16};
  FreeSpaceView view_{at(2.0F), SE3(), kTolerance};
};

TEST_F(AWallSeenFromTheSamePlace, TellsThatThePlaceOfTheWallIsTaken) {
  const FreeSpaceEvidence evidence = judged(2.0F);
  EXPECT_EQ(cv::countNonZero(evidence.taken), grid_.size().area());
  EXPECT_EQ(cv::countNonZero(evidence.free), 0);
}

TEST_F(AWallSeenFromTheSamePlace, TellsThatTheSpaceBeforeItIsFree) {
  const FreeSpaceEvidence evidence = judged(1.0F);
  EXPECT_EQ(cv::countNonZero(evidence.free), grid_.size().area());
  EXPECT_EQ(cv::countNonZero(evidence.taken), 0);
}

TEST_F(AWallSeenFromTheSamePlace, TellsNothingAboutWhatIsBehindIt) {
  const FreeSpaceEvidence evidence = judged(4.0F);
  EXPECT_EQ(cv::countNonZero(evidence.free | evidence.taken), 0);
}

TEST_F(AWallSeenFromTheSamePlace, TellsOnlyOfFreeSpaceWhereItWasAMover) {
  cv::Mat moving = cv::Mat::zeros(grid_.size(), CV_8UC1);
  moving.colRange(0, 8).setTo(255);
  view_.distrust(moving);
  EXPECT_EQ(cv::countNonZero(judged(2.0F).taken), grid_.size().area() / 2);
  EXPECT_EQ(cv::countNonZero(judged(1.0F).free), grid_.size().area());
}

TEST_F(AWallSeenFromTheSamePlace, StaysTakenHoweverOftenItIsSeen) {
  FreeSpaceEvidence evidence(grid_.size());
  for (int i = 0; i < 300; ++i) view_.judge(grid_, at(2.0F), SE3(), evidence);
  EXPECT_EQ(cv::countNonZero(evidence.taken == 255), grid_.size().area());
}

}  // namespace
}  // namespace ipl_slam
