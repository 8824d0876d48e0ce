#include "dataset/trajectory.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ipl_slam/error.hpp>

#include "dataset/temporary_folder.hpp"

namespace ipl_slam {
namespace {

using ::testing::AllOf;
using testing::content_of;
using ::testing::HasSubstr;
using testing::message_of;
using testing::TemporaryFolder;

std::string failure_of_reading(const std::filesystem::path& file) {
  return message_of<UserError>([&] { (void)read_trajectory(file); });
}

TEST(Trajectory, IsReadAsTheBenchmarkWritesIt) {
  const TemporaryFolder folder;
  const auto file = folder.write(
      "gt.txt", "# timestamp tx ty tz qx qy qz qw\r\n1305031453.2695 1 2 3 0 0 1.4142 1.4142\r\n");
  const Trajectory trajectory = read_trajectory(file);
  ASSERT_EQ(trajectory.size(), 1u);
  EXPECT_EQ(trajectory[0].timestamp, 1305031453.2695);
  EXPECT_EQ(trajectory[0].T_wc.translation(), Eigen::Vector3d(1, 2, 3));
  // A quarter turn about z, from a quaternion that is not normalised: x goes to y.
  const Eigen::Vector3d turned = trajectory[0].T_wc.rotation() * Eigen::Vector3d::UnitX();
  EXPECT_NEAR((turned - Eigen::Vector3d::UnitY()).norm(), 0.0, 1e-15);
}

TEST(Trajectory, LeavesOutAndCountsLinesThatAreNoPose) {
  const TemporaryFolder folder;
  const auto file = folder.write("gt.txt",
                                 "1 0 0 0 0 0 0 1\n"
                                 "2 nan 0 0 0 0 0 1\n"
                                 "3 0 0 0 NaN 0 0 1\n"
                                 "4 0 inf 0 0 0 0 1\n"
                                 "5 0 0 0 0 0 0 0\n"
                                 "6 0 0 0 0 0 0 1\n"
                                 "6 1 0 0 0 0 0 1\n"
                                 "5.5 0 0 0 0 0 0 1\n"
                                 "nan 0 0 0 0 0 0 1\n"
                                 "7 0 0 0 0 0 0 1\n");
  std::size_t rejected = 0;
  const Trajectory trajectory = read_trajectory(file, &rejected);
  ASSERT_EQ(trajectory.size(), 3u);
  EXPECT_EQ(rejected, 7u);
  EXPECT_EQ(trajectory[1].timestamp, 6.0);
  EXPECT_EQ(trajectory[1].T_wc.translation().x(), 0.0) << "of duplicates the first stays";
  EXPECT_EQ(trajectory[2].timestamp, 7.0);
}

TEST(Trajectory, NamesFileAndLineThatCannotBeUnderstood) {
  const TemporaryFolder folder;
  for (const char* line : {"2 0 0 0 0 0 1", "2 0 0 0 0 0 0 1 9", "2 0 0 zero 0 0 0 1"}) {
    const auto file = folder.write("t.txt", std::string("# head\n1 0 0 0 0 0 0 1\n") + line + "\n");
    EXPECT_THAT(failure_of_reading(file),
                AllOf(HasSubstr("t.txt:3: cannot understand"), HasSubstr("qx qy qz qw")));
  }
}

TEST(Trajectory, IsRefusedWithoutAnyPose) {
  const TemporaryFolder folder;
  EXPECT_THAT(failure_of_reading(folder.write("empty.txt", "# nothing\n")),
              HasSubstr("empty.txt' holds no pose"));
  EXPECT_THAT(failure_of_reading(folder.write("nan.txt", "1 nan nan nan 0 0 0 1\n")),
              HasSubstr("without NaN"));
  EXPECT_THAT(failure_of_reading(folder / "none.txt"), HasSubstr("no such file"));
}

TEST(Trajectory, ComesBackFromItsFileToTheDigitsWritten) {
  const TemporaryFolder folder;
  Trajectory trajectory;
  for (int i = 0; i < 50; ++i) {
    Vector6d twist;
    twist << 0.1 * i, -0.2 * i, 3.0, 0.06 * i, 0.5, -0.3;
    trajectory.push_back({1305031453.0 + i / 30.0, SE3::exp(twist)});
  }
  write_trajectory(folder / "t.txt", trajectory);
  const Trajectory back = read_trajectory(folder / "t.txt");
  ASSERT_EQ(back.size(), trajectory.size());
  for (std::size_t i = 0; i < back.size(); ++i) {
    EXPECT_NEAR(back[i].timestamp, trajectory[i].timestamp, 0.6e-6);  // 6 decimals
    const SE3 difference = back[i].T_wc.inverse() * trajectory[i].T_wc;
    EXPECT_LT(difference.translation().norm(), 2e-8);  // 9 decimals on t, and on q times a lever of 15 m
    EXPECT_LT(difference.angle(), 4e-9);               // twice the rounding of four components
  }
}

TEST(Trajectory, IsWrittenWithSixAndNineDecimals) {
  const TemporaryFolder folder;
  write_trajectory(folder / "t.txt", {{12.5, SE3(Eigen::Quaterniond::Identity(), {1.0, -2.0, 0.25})}});
  EXPECT_THAT(content_of(folder / "t.txt"), HasSubstr("\n12.500000 1.000000000 -2.000000000 0.250000000 "
                                                      "0.000000000 0.000000000 0.000000000 1.000000000\n"));
}

TEST(TrajectoryParts, TheLongestComesFirstAndAmongEqualsTheOldest) {
  TrajectoryParts parts;
  for (const std::uint32_t part : {3U, 1U, 2U, 2U, 1U, 0U}) {
    parts.add(PartId{part}, {1.0, SE3{}});
  }
  std::vector<std::uint32_t> order;
  for (const TrajectoryPart& part : parts.longest_first()) order.push_back(part.part.value);
  EXPECT_EQ(order, (std::vector<std::uint32_t>{1, 2, 0, 3}));
}

TEST(TrajectoryParts, KeepTheOrderInWhichPosesCame) {
  TrajectoryParts parts;
  for (const double time : {1.0, 2.0, 3.0}) {
    parts.add(PartId{time == 2.0 ? 1U : 0U}, {time, SE3{}});
  }
  const std::vector<TrajectoryPart> sorted = parts.longest_first();
  ASSERT_EQ(sorted.size(), 2U);
  ASSERT_EQ(sorted[0].poses.size(), 2U);
  EXPECT_EQ(sorted[0].poses[0].timestamp, 1.0);
  EXPECT_EQ(sorted[0].poses[1].timestamp, 3.0);
  EXPECT_EQ(sorted[1].poses[0].timestamp, 2.0);
}

TEST(TrajectoryParts, WithoutAPoseThereIsOneEmptyList) {
  const std::vector<TrajectoryPart> sorted = TrajectoryParts().longest_first();
  ASSERT_EQ(sorted.size(), 1U);
  EXPECT_TRUE(sorted[0].poses.empty());
  EXPECT_FALSE(sorted[0].part.valid());
}

TEST(TrajectoryParts, AllButTheFirstAreWrittenAsCommentsThatReadersPassOver) {
  const SE3 T_wc(Eigen::Quaterniond::Identity(), {1.0, 2.0, 3.0});
  const std::vector<TrajectoryPart> parts{{PartId{2}, {{1.5, T_wc}, {1.6, T_wc}}},
                                          {PartId{0}, {{0.5, T_wc}}}};
  EXPECT_EQ(trajectory_text(parts),
            "# timestamp tx ty tz qx qy qz qw (camera to world, s, m)\n"
            "1.500000 1.000000000 2.000000000 3.000000000 0.000000000 0.000000000 0.000000000 1.000000000\n"
            "1.600000 1.000000000 2.000000000 3.000000000 0.000000000 0.000000000 0.000000000 1.000000000\n"
            "# part 0: 0.500000 1.000000000 2.000000000 3.000000000 0.000000000 0.000000000 0.000000000 "
            "1.000000000\n");
  const TemporaryFolder folder;
  write_trajectory(folder / "parts.txt", parts);
  std::size_t rejected = 1;
  const Trajectory read = read_trajectory(folder / "parts.txt", &rejected);
  EXPECT_EQ(rejected, 0U);
  ASSERT_EQ(read.size(), 2U);
  EXPECT_EQ(read[0].timestamp, 1.5);
}

TEST(Trajectory, SaysWhereItCannotBeWritten) {
  const TemporaryFolder folder;
  const auto file = folder.write("file", "");
  EXPECT_THAT(message_of<UserError>([&] { write_trajectory(file / "t.txt", Trajectory{}); }),
              HasSubstr("cannot write"));
}

}  // namespace
}  // namespace ipl_slam
