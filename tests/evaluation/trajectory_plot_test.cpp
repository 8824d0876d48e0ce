#include "evaluation/trajectory_plot.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ipl_slam/error.hpp>

#include "evaluation/made_trajectory.hpp"
#include "evaluation/plot_canvas.hpp"

namespace ipl_slam {
namespace {

using testing::cross;
using ::testing::DoubleNear;
using ::testing::ElementsAre;
using testing::steady_motion;
using testing::trajectory_of;

cv::Mat drawn(const Trajectory& truth, const Trajectory& estimate) {
  return draw_trajectory(truth, estimate, absolute_trajectory_error(truth, estimate), {"a test", 800, 700});
}

/// Pixels of the middle of the upper plot, clear of the legend, that are clearly red or clearly blue.
struct Colored {
  int red = 0, blue = 0;
};

Colored count_colored(const cv::Mat& picture) {
  Colored count;
  for (int y = 60; y < 440; ++y) {
    for (int x = 110; x < 540; ++x) {
      const cv::Vec3b c = picture.at<cv::Vec3b>(y, x);
      count.red += c[2] > c[0] + 80 && c[2] > c[1] + 80;
      count.blue += c[0] > c[2] + 80;
    }
  }
  return count;
}

TEST(TrajectoryPlot, HasTheSizeAskedFor) {
  const cv::Mat picture = drawn(cross(1.0), cross(1.1));
  EXPECT_EQ(picture.size(), cv::Size(800, 700));
  EXPECT_EQ(picture.type(), CV_8UC3);
}

TEST(TrajectoryPlot, ShowsRedLinesWhereTheEstimateIsOff) {
  const Trajectory truth = steady_motion(20, 1.0);
  Trajectory zigzag = truth;
  for (std::size_t i = 0; i < zigzag.size(); ++i) {
    const Eigen::Vector3d aside(0.0, i % 2 == 0 ? 0.3 : -0.3, 0.0);
    zigzag[i].T_wc = SE3(Eigen::Quaterniond::Identity(), zigzag[i].T_wc.translation() + aside);
  }
  const Colored perfect = count_colored(drawn(truth, truth));
  EXPECT_GT(perfect.blue, 400) << "the estimate's line is at least as long as the counted area is wide";
  EXPECT_EQ(perfect.red, 0);
  EXPECT_GT(count_colored(drawn(truth, zigzag)).red, 200);
}

// Half of the estimate lies on either side, so that aligning it changes nothing; its differences are so many
// that they fill the area between the paths.
TEST(TrajectoryPlot, ShowsTheTruthInBlackOverTheDifferences) {
  constexpr std::size_t kPoses = 1200;
  const Trajectory truth = steady_motion(kPoses, 1.0);
  const double aside = 0.1 * (truth.back().T_wc.translation() - truth.front().T_wc.translation()).norm();
  Trajectory estimate = truth;
  for (std::size_t i = 0; i < kPoses; ++i) {
    const std::size_t quarter = 4 * i / kPoses;
    const Eigen::Vector3d offset(0.0, quarter == 0 || quarter == 3 ? aside : -aside, 0.0);
    estimate[i].T_wc = SE3(Eigen::Quaterniond::Identity(), truth[i].T_wc.translation() + offset);
  }
  const cv::Mat picture = drawn(truth, estimate);
  int columns = 0;
  for (int x = 110; x < 540; ++x) {
    bool black = false;
    for (int y = 60; y < 440; ++y) {
      const cv::Vec3b c = picture.at<cv::Vec3b>(y, x);
      black |= c[0] < 60 && c[1] < 60 && c[2] < 60;
    }
    columns += black ? 1 : 0;
  }
  EXPECT_GT(columns, 390) << "all of 430 but its beginning and where the estimate crosses";
}

TEST(TrajectoryPlot, DrawsNoLineWhereTrackingWasLost) {
  const Trajectory truth = steady_motion(81, 1.0);
  Trajectory estimate = truth;
  estimate.erase(estimate.begin() + 10, estimate.begin() + 70);
  EXPECT_LT(count_colored(drawn(truth, estimate)).blue, count_colored(drawn(truth, truth)).blue / 2);
}

TEST(TrajectoryPlot, OfACameraThatStandsStillIsDrawn) {
  const Trajectory still = trajectory_of(std::vector<Eigen::Vector3d>(5, {1, 2, 3}));
  EXPECT_EQ(drawn(still, still).size(), cv::Size(800, 700));
}

TEST(TrajectoryPlot, CannotBeWrittenIntoAFolderThatDoesNotExist) {
  const AteResult ate = absolute_trajectory_error(cross(1.0), cross(1.1));
  EXPECT_THROW(write_trajectory_plot("/proc/none/plot.png", cross(1.0), cross(1.1), ate), UserError);
}

TEST(PlotTicks, AreRoundNumbersInsideTheRange) {
  const Ticks ticks = ticks_between(-0.13, 0.42, 6.0);
  EXPECT_EQ(ticks.decimals, 1);
  EXPECT_THAT(ticks.values,
              ElementsAre(DoubleNear(-0.1, 1e-12), 0.0, DoubleNear(0.1, 1e-12), DoubleNear(0.2, 1e-12),
                          DoubleNear(0.3, 1e-12), DoubleNear(0.4, 1e-12)));
  EXPECT_THAT(ticks_between(0.0, 100.0, 2.0).values, ElementsAre(0.0, 50.0, 100.0));
  EXPECT_EQ(ticks_between(0.0, 100.0, 2.0).decimals, 0);
  EXPECT_EQ(ticks_between(1.0, 1.004, 4.0).decimals, 3);
}

}  // namespace
}  // namespace ipl_slam
