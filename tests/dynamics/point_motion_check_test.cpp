#include "dynamics/point_motion_check.hpp"

#include <algorithm>
#include <numeric>

#include <gtest/gtest.h>

#include "dynamics/point_grid.hpp"

namespace ipl_slam {
namespace {

using namespace test;

// Keypoints are floats: a few 1e-5 px, which in units of the deviations below is less than this.
constexpr double kFloat = 1e-3;

PointMotionOptions depth_options() {
  PointMotionOptions o;
  o.check = "depth";
  o.search_radius = 30.0;
  o.pixel_sigma = 2.0;
  o.inverse_depth_sigma = 0.05;
  o.threshold = 10.0;
  o.match = {.max_distance = 60, .ratio = 0.8, .max_rotation = 0.35, .inverse_depth_gate = 0.0};
  return o;
}

PointMotionOptions epipolar_options() {
  PointMotionOptions o = depth_options();
  o.check = "epipolar";
  o.epipolar.threshold = 1.0;
  o.epipolar.min_pairs = 30;
  o.epipolar.min_agreement = 0.5;
  o.epipolar.max_samples = 200;
  return o;
}

std::size_t count(const std::vector<std::uint8_t>& flags) {
  return static_cast<std::size_t>(std::accumulate(flags.begin(), flags.end(), 0));
}
std::size_t count(const std::vector<std::optional<double>>& values) {
  return static_cast<std::size_t>(
      std::count_if(values.begin(), values.end(), [](const auto& v) { return v.has_value(); }));
}

const std::vector<std::uint8_t> kAll(PointGrid::kSize, 1);

PointMotion compare(const Features& before, const Features& now, const std::optional<SE3>& T_now_before,
                    const PointMotionOptions& options = depth_options(),
                    const std::vector<std::uint8_t>& witness = kAll) {
  return PointMotionCheck(kTestCamera, kTestPyramid, options)
      .compare(*SyntheticWorld::make_frame(before), *SyntheticWorld::make_frame(now, 1), T_now_before,
               witness);
}

// Nothing is known, of as many points as there are.
void expect_nothing(const PointMotion& motion, std::size_t points = PointGrid::kSize) {
  EXPECT_EQ(motion.judged, std::vector<std::uint8_t>(points, 0));
  EXPECT_EQ(motion.dynamic, std::vector<std::uint8_t>(points, 0));
  EXPECT_EQ(motion.surprise.size(), points);
  EXPECT_EQ(motion.distance.size(), points);
  EXPECT_EQ(count(motion.surprise), 0U);
}

// 3 cm sideways and 5 cm ahead with a turn: up to 25 px of which no point is to blame.
const SE3 kWalk = camera_at({0.03, 0.0, 0.05}, 0.02, 0.01);

TEST(PointMotionCheck, PointsAreStillWhereOnlyTheCameraMoved) {
  const PointGrid grid;
  const PointMotion motion = compare(grid.look(), grid.look(kWalk), kWalk);
  EXPECT_EQ(motion.judged, kAll);
  EXPECT_EQ(count(motion.dynamic), 0U);
  for (std::size_t k = 0; k < PointGrid::kSize; ++k) {
    EXPECT_NEAR(motion.surprise[k].value(), 0.0, kFloat);
    EXPECT_NEAR(motion.distance[k].value(), 0.0, 1e-6);
  }
}

// Of 108 points one is not where the camera's motion alone would put it.
class AMovedPoint : public testing::Test {
 protected:
  // It lies straight ahead at 2 m; the camera goes 0.1 m to the left and 0.5 m back. So it is carried to
  // (0.1, 0, 2.5) m, its image to (319.5 + 525 * 0.04, 239.5) = (340.5, 239.5).
  AMovedPoint() {
    PointGrid grid;
    grid.positions[kPoint] = {0.0, 0.0, 2.0};
    before = grid.look();
    now = grid.look(T_now_before);
    now.keypoints[kPoint].undistorted = {343.5F, 243.5F};  // 3 and 4 px off: 25 px^2
    now.keypoints[kPoint].depth = 2.0F;                    // 1/2 - 1/2.5 = 0.1 1/m off
  }
  [[nodiscard]] PointMotion compare_with(const PointMotionOptions& options) const {
    return compare(before, now, T_now_before, options);
  }

  static constexpr std::size_t kPoint = 42;
  const SE3 T_now_before{Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.1, 0.0, 0.5)};
  Features before, now;
};

TEST_F(AMovedPoint, HasTheSurpriseOfItsResidual) {
  // 25 / 2^2 + (0.1 / 0.05)^2 = 6.25 + 4.
  PointMotionOptions options = depth_options();
  options.threshold = 10.3;
  PointMotion motion = compare_with(options);
  EXPECT_NEAR(motion.surprise[kPoint].value(), 10.25, kFloat);
  EXPECT_EQ(motion.judged, kAll);
  EXPECT_EQ(count(motion.dynamic), 0U);
  options.threshold = 10.2;
  motion = compare_with(options);
  EXPECT_EQ(motion.dynamic[kPoint], 1);
  EXPECT_EQ(count(motion.dynamic), 1U) << "the others are still";
}

TEST_F(AMovedPoint, HasTheDistanceThatIsLeftWithoutTheCamerasMotion) {
  // It is seen at (24 / 525 * 2, 4 / 525 * 2, 2).
  const PointMotion motion = compare_with(depth_options());
  const Eigen::Vector3d seen(48.0 / 525.0, 8.0 / 525.0, 2.0);
  EXPECT_NEAR(motion.distance[kPoint].value(), (seen - Eigen::Vector3d(0.1, 0.0, 2.5)).norm(), 1e-6);
  EXPECT_NEAR(motion.distance[kPoint].value(), 0.5003, 1e-4);
}

TEST_F(AMovedPoint, IsJudgedMoreMildlyOnACoarseLevel) {
  now.keypoints[kPoint].level = 1;  // the coarser of the two counts: 25 / (2 * 1.2)^2 + 4
  EXPECT_NEAR(compare_with(depth_options()).surprise[kPoint].value(), 25.0 / 5.76 + 4.0, kFloat);
  std::swap(before.keypoints[kPoint].level, now.keypoints[kPoint].level);
  EXPECT_NEAR(compare_with(depth_options()).surprise[kPoint].value(), 25.0 / 5.76 + 4.0, kFloat);
}

TEST_F(AMovedPoint, IsJudgedByItsPixelWhereItHasNoDepthNow) {
  now.keypoints[kPoint].depth = 0.0F;
  const PointMotion motion = compare_with(depth_options());
  EXPECT_NEAR(motion.surprise[kPoint].value(), 6.25, kFloat);
  EXPECT_EQ(motion.judged[kPoint], 1);
  EXPECT_FALSE(motion.distance[kPoint]);
}

TEST_F(AMovedPoint, IsNotJudgedWhereItHadNoDepthBefore) {
  before.keypoints[kPoint].depth = 0.0F;
  const PointMotion motion = compare_with(depth_options());
  EXPECT_EQ(motion.judged[kPoint] + motion.dynamic[kPoint], 0);
  EXPECT_FALSE(motion.surprise[kPoint]);
  EXPECT_FALSE(motion.distance[kPoint]);
  EXPECT_EQ(count(motion.judged), PointGrid::kSize - 1) << "the others are";
}

TEST_F(AMovedPoint, IsNotFoundBeyondTheSearchRadius) {
  now.keypoints[kPoint].undistorted = {340.5F, 239.5F + 29.0F};
  EXPECT_EQ(compare_with(depth_options()).dynamic[kPoint], 1);
  now.keypoints[kPoint].undistorted = {340.5F, 239.5F + 31.0F};
  const PointMotion motion = compare_with(depth_options());
  EXPECT_EQ(motion.judged[kPoint] + motion.dynamic[kPoint], 0);
  EXPECT_FALSE(motion.distance[kPoint]);
}

TEST_F(AMovedPoint, IsNotJudgedWhereTheDescriptorIsAnother) {
  for (auto& word : now.descriptors[kPoint]) word = ~word;
  const PointMotion motion = compare_with(depth_options());
  EXPECT_EQ(motion.judged[kPoint], 0);
  EXPECT_EQ(count(motion.judged), PointGrid::kSize - 1);
}

TEST_F(AMovedPoint, TellsNothingWithTheCheckOff) {
  PointMotionOptions options = depth_options();
  options.check = "off";
  const PointMotion motion = compare_with(options);
  expect_nothing(motion);
  EXPECT_EQ(count(motion.distance), 0U);
}

TEST(PointMotionCheck, JudgesNothingByDepthWithoutAPose) {
  const PointGrid grid;
  const PointMotion motion = compare(grid.look(), grid.look(), std::nullopt);
  expect_nothing(motion);
  EXPECT_EQ(count(motion.distance), 0U);
}

TEST(PointMotionCheck, JudgesNothingThatLiesBehindTheCamera) {
  // On the optical axis the image of a point stays where it is, even as it passes the camera.
  PointGrid grid;
  grid.positions[42] = {0.0, 0.0, 2.0};
  const auto passed = [](double z) {
    return SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.0, 0.0, -z));
  };
  PointMotion motion = compare(grid.look(), grid.look(), passed(1.5));
  EXPECT_EQ(motion.judged[42], 1) << "half a metre before it";
  motion = compare(grid.look(), grid.look(), passed(2.5));
  EXPECT_EQ(motion.judged[42], 0);
  EXPECT_FALSE(motion.surprise[42]);
  EXPECT_FALSE(motion.distance[42]);
}

TEST(PointMotionCheck, BearsFramesThatHaveNothingInCommon) {
  const PointGrid grid;
  PointGrid other = grid;
  for (Descriptor& descriptor : other.descriptors) {
    for (auto& word : descriptor) word = ~word;
  }
  for (const PointMotionOptions& options : {depth_options(), epipolar_options()}) {
    expect_nothing(compare(grid.look(), other.look(), SE3(), options));
    expect_nothing(compare({}, grid.look(), SE3(), options));
    expect_nothing(compare(grid.look(), {}, SE3(), options, {}), 0);
  }
}

// The camera goes 0.1 m to the right: all epipolar lines are level, and points move 18 to 26 px along them.
class SidewaysMotion : public testing::Test {
 protected:
  [[nodiscard]] PointMotion judge(const std::optional<SE3>& T,
                                  const std::vector<std::uint8_t>& witness = kAll) const {
    return compare(before, now, T, epipolar_options(), witness);
  }

  const PointGrid grid;
  const SE3 T_now_before = camera_at({0.1, 0.0, 0.0});
  Features before = grid.look(), now = grid.look(T_now_before);
};

TEST_F(SidewaysMotion, EpipolarLinesTellWhatMovesAcrossThem) {
  now.keypoints[50].undistorted.y() += 5.0F;
  now.keypoints[60].undistorted.x() += 3.0F;  // along the line: cannot be told
  for (const std::optional<SE3>& T : {std::optional<SE3>(T_now_before), std::optional<SE3>()}) {
    const PointMotion motion = judge(T);
    EXPECT_EQ(motion.judged, kAll);
    EXPECT_EQ(motion.dynamic[50], 1);
    EXPECT_EQ(count(motion.dynamic), 1U);
    EXPECT_EQ(count(motion.surprise), 0U) << "there is no residual of a point";
    EXPECT_EQ(count(motion.distance), T ? PointGrid::kSize : 0U) << "distances need a pose";
  }
}

TEST_F(SidewaysMotion, WitnessesAloneSayWhatIsStill) {
  // Two thirds go down by 6 px together.
  std::vector<std::uint8_t> witness = kAll, moved(PointGrid::kSize, 0);
  for (std::size_t k = 0; k < PointGrid::kSize; ++k) {
    if (k % 3 == 0) continue;
    now.keypoints[k].undistorted.y() += 6.0F;
    moved[k] = 1;
    witness[k] = 0;
  }
  const PointMotion motion = judge(T_now_before, witness);
  EXPECT_EQ(motion.judged, kAll);
  EXPECT_EQ(motion.dynamic, moved);
  EXPECT_NE(judge(T_now_before).dynamic, moved) << "without them the many are believed";
}

TEST_F(SidewaysMotion, WithTooFewWitnessesNothingIsJudged) {
  std::vector<std::uint8_t> witness(PointGrid::kSize, 0);
  expect_nothing(judge(T_now_before, witness));
  std::fill_n(witness.begin(), 29, 1);
  expect_nothing(judge(T_now_before, witness));
}

TEST(PointMotionCheck, WhereTheCameraOnlyTurnsThereIsNoEpipolarGeometry) {
  const PointGrid grid;
  const SE3 turn = camera_at({0.0, 0.0, 0.0}, 0.02, 0.01);  // 10 px
  Features now = grid.look(turn);
  now.keypoints[50].undistorted.y() += 5.0F;
  expect_nothing(compare(grid.look(), now, turn, epipolar_options()));
  expect_nothing(compare(grid.look(), grid.look(), SE3(), epipolar_options()));
  EXPECT_EQ(compare(grid.look(), now, turn, depth_options()).judged, kAll) << "depth needs none";
}

}  // namespace
}  // namespace ipl_slam
