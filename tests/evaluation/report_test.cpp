#include "evaluation/report.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ipl_slam/error.hpp>

#include "evaluation/made_trajectory.hpp"

namespace ipl_slam {
namespace {

using ::testing::AllOf;
using ::testing::ContainsRegex;
using testing::cross;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::steady_motion;

/// Three runs whose ATE mean is 0.15, 0.30 and 0.45 m.
std::vector<Evaluation> three_runs() {
  return {evaluate(cross(1.0), cross(1.1), "a.txt"), evaluate(cross(1.0), cross(1.2), "b.txt"),
          evaluate(cross(1.0), cross(1.3), "c.txt")};
}

TEST(EvaluationTable, OfOneTrajectoryHasARowPerKindOfError) {
  const Trajectory truth = steady_motion(25, 1.0);
  const std::string table = evaluation_table({evaluate(truth, steady_motion(25, 1.08, 16.0), "run.txt")});
  EXPECT_THAT(table, AllOf(HasSubstr("run.txt: 25 of 25 poses have ground truth, 100.0 %"),
                           HasSubstr("ATE [m]"), ContainsRegex("RPE over 1 frame .m. +23 "),
                           ContainsRegex("RPE over 1 s .deg. +16 +16.000 ")));
  EXPECT_THAT(table, Not(HasSubstr("mean of")));
}

TEST(EvaluationTable, OfSeveralTrajectoriesEndsInMeanAndStd) {
  const std::string table = evaluation_table(three_runs());
  EXPECT_THAT(table, AllOf(HasSubstr("a.txt"), HasSubstr("c.txt"), HasSubstr("0.3000"), HasSubstr("0.1500")));
  EXPECT_LT(table.find("mean of 3"), table.find("± std"));
}

TEST(EvaluationTable, ShowsADashForARelativeErrorThatCannotBeTaken) {
  const Evaluation evaluation = evaluate(cross(1.0), cross(1.1), "short.txt");
  EXPECT_FALSE(evaluation.rpe_second) << "half a second has no pairs a second apart";
  EXPECT_THAT(evaluation_table({evaluation}), ContainsRegex("RPE over 1 s +0 +- "));
  EXPECT_TRUE(evaluation_json(evaluation)["rpe_second"].is_null());
}

TEST(EvaluationJson, HoldsEveryFigureInFullPrecision) {
  const Trajectory truth = steady_motion(25, 1.0);
  const Evaluation evaluation = evaluate(truth, steady_motion(25, 1.08, 16.0), "run.txt");
  const auto json = nlohmann::json::parse(evaluation_json(std::vector{evaluation}).dump());
  const auto& run = json.at("trajectories").at(0);
  EXPECT_EQ(run.at("name"), "run.txt");
  EXPECT_EQ(run.at("ate").at("pairs"), 25);
  for (const char* key : {"rmse", "mean", "median", "std", "min", "max", "coverage", "alignment"}) {
    EXPECT_TRUE(run.at("ate").contains(key)) << key;
  }
  EXPECT_EQ(run.at("ate").at("rmse").get<double>(), evaluation.ate.rmse);
  EXPECT_EQ(run.at("rpe_second").at("rotation_deg").at("rmse").get<double>(),
            evaluation.rpe_second->rot_rmse);
  EXPECT_EQ(run.at("rpe_frame").at("translation").at("max").get<double>(), evaluation.rpe_frame->trans_max);
  EXPECT_FALSE(json.contains("summary"));
}

// 0.15, 0.30, 0.45: mean 0.30, sample deviation 0.15.
TEST(EvaluationJson, SummarisesSeveralTrajectories) {
  const auto summary = evaluation_json(three_runs()).at("summary");
  EXPECT_EQ(summary.at("ate_mean").at("runs"), 3);
  EXPECT_NEAR(summary.at("ate_mean").at("mean").get<double>(), 0.30, 1e-12);
  EXPECT_NEAR(summary.at("ate_mean").at("std").get<double>(), 0.15, 1e-12);
  EXPECT_NEAR(summary.at("ate_rmse").at("mean").get<double>(), 0.2 * std::sqrt(2.5), 1e-12);
  EXPECT_TRUE(summary.at("rpe_second_rot_rmse").is_null());
}

TEST(Evaluation, ThatFailsNamesTheTrajectory) {
  Trajectory later = cross(1.0);
  for (StampedPose& pose : later) pose.timestamp += 50.0;
  std::string message;
  try {
    (void)evaluate(cross(1.0), later, "second.txt");
  } catch (const UserError& error) {
    message = error.what();
  }
  EXPECT_THAT(message, HasSubstr("second.txt: only 0 poses"));
}

}  // namespace
}  // namespace ipl_slam
