#include "dynamics/line_motion_check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "common/random.hpp"

namespace ipl_slam {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
const Camera kCamera;

LineSegment segment(const Eigen::Vector2f& start, const Eigen::Vector2f& end) {
  LineSegment s;
  s.start = s.start_pixel = start;
  s.end = s.end_pixel = end;
  return s;
}

TEST(MeanAngleDifference, IsZeroForAShift) {
  EXPECT_EQ(mean_angle_difference(segment({0, 0}, {10, 0}), segment({30, 40}, {40, 40}), 1.0), 0.0);
}

TEST(MeanAngleDifference, IsTheMeanOfTheThreeDifferences) {
  // Ways: start (4, 0), end (0, 4), middle (2, 2): angles 0, pi/2, pi/4; differences pi/4, pi/2, pi/4.
  EXPECT_NEAR(mean_angle_difference(segment({0, 0}, {10, 0}), segment({4, 0}, {10, 4}), 1.0), kPi / 3.0,
              1e-12);
}

TEST(MeanAngleDifference, IsWrapped) {
  // Ways: start (-4, 1), end (-4, -1), middle (-4, 0), to either side of the negative x-axis: the angles are
  // pi - a, -pi + a and pi with a = atan(1/4); differences 2 a, a and a, not 2 pi - 2 a.
  const double a = std::atan(0.25);
  EXPECT_NEAR(mean_angle_difference(segment({0, 0}, {10, 0}), segment({-4, 1}, {6, -1}), 1.0), 4.0 * a / 3.0,
              1e-12);
}

TEST(MeanAngleDifference, LeavesOutWaysShorterThanTheNoise) {
  // A turn about the middle: start up, end down, middle at rest. One difference of pi is left.
  const LineSegment before = segment({0, 0}, {10, 0}), now = segment({0, -3}, {10, 3});
  EXPECT_NEAR(mean_angle_difference(before, now, 1.0), kPi / 3.0, 1e-12);
  EXPECT_EQ(mean_angle_difference(before, now, 3.5), 0.0);
  EXPECT_EQ(mean_angle_difference(before, before, 1.0), 0.0);
  EXPECT_EQ(mean_angle_difference(before, before, 0.0), 0.0);
}

TEST(MeanAngleDifference, IsZeroWhereAWayIsNoNumber) {
  const LineSegment before = segment({0, 0}, {10, 0});
  const auto nan = static_cast<float>(kNaN);
  EXPECT_EQ(mean_angle_difference(before, segment({nan, nan}, {nan, nan}), 1.0), 0.0);
}

/// An edge in space, camera frame of the keyframe before, m.
struct Edge {
  Eigen::Vector3d start, end;
};

LineSegment seen(const Edge& edge, const SE3& T) {
  const Eigen::Vector3d a = T * edge.start, b = T * edge.end;
  LineSegment s = segment(kCamera.project(a).cast<float>(), kCamera.project(b).cast<float>());
  s.depth.inverse_start = static_cast<float>(1.0 / a.z());
  s.depth.inverse_end = static_cast<float>(1.0 / b.z());
  s.depth.covariance = 1e-6F * Eigen::Matrix2f::Identity();  // 0.001 1/m, the resolution of a Kinect
  return s;
}

/// 40 edges on a slanted wall, each with a descriptor of its own, and the same seen after a motion.
class LinesOfTwoKeyframes : public testing::Test {
 protected:
  LinesOfTwoKeyframes() {
    Random random(1);
    for (int i = 0; i < 40; ++i) {
      const Eigen::Vector3d start(random.uniform(-1.0, 1.0), random.uniform(-0.7, 0.7), 2.0);
      const double angle = random.uniform(-kPi, kPi);
      const Eigen::Vector3d way(0.3 * std::cos(angle), 0.3 * std::sin(angle), random.uniform(-0.1, 0.1));
      edges.push_back({start, start + way});
      descriptors.push_back({random.bits(), random.bits(), random.bits(), random.bits()});
    }
  }

  [[nodiscard]] LineFeatures look(const SE3& T) const {
    LineFeatures lines;
    for (const Edge& edge : edges) lines.segments.push_back(seen(edge, T));
    lines.descriptors = descriptors;
    return lines;
  }

  void shift(std::size_t edge, const Eigen::Vector3d& by) { edges[edge].start += by, edges[edge].end += by; }

  [[nodiscard]] static LineMotion compare(const LineFeatures& before, const LineFeatures& now, const SE3& T,
                                          const LineMotionOptions& options = {}) {
    return LineMotionCheck(kCamera, options).compare(before, now, T);
  }

  /// Edge 0 lies level, 0.4 m long, straight ahead.
  void put_level_edge() { edges[0] = {{-0.2, 0.0, 2.0}, {0.2, 0.0, 2.0}}; }

  std::vector<Edge> edges;
  std::vector<Descriptor> descriptors;
  const SE3 T_now_before = SE3::exp((Vector6d() << 0.05, -0.02, 0.06, 0.01, 0.02, -0.01).finished());
};

std::size_t count(const std::vector<std::uint8_t>& flags) {
  return static_cast<std::size_t>(std::count(flags.begin(), flags.end(), 1));
}

TEST_F(LinesOfTwoKeyframes, AreStillWhereOnlyTheCameraMoved) {
  const LineMotion motion = compare(look(SE3()), look(T_now_before), T_now_before);
  EXPECT_EQ(count(motion.matched), edges.size());
  EXPECT_EQ(count(motion.dynamic), 0U);
  EXPECT_EQ(motion.weight, std::vector<double>(edges.size(), 1.0));
}

TEST_F(LinesOfTwoKeyframes, AreDynamicWhereTheyMovedAcross) {
  put_level_edge();
  const LineFeatures before = look(SE3());
  shift(0, {0.0, 0.05, 0.0});  // 13 pixels
  const LineMotion motion = compare(before, look(T_now_before), T_now_before);
  EXPECT_TRUE(motion.matched[0] != 0 && motion.dynamic[0] != 0);
  EXPECT_EQ(motion.weight[0], 0.0);
  EXPECT_EQ(count(motion.dynamic), 1U);
}

TEST_F(LinesOfTwoKeyframes, AreDynamicWhereTheyMovedAwayFromTheCamera) {
  // Straight ahead a level line stays on its image when it recedes: its depth alone tells.
  put_level_edge();
  const LineFeatures before = look(SE3());
  shift(0, {0.0, 0.0, 0.5});  // 1/2 to 1/2.5: 0.1 1/m
  const LineMotion motion = compare(before, look(SE3()), SE3());
  EXPECT_TRUE(motion.matched[0] != 0 && motion.dynamic[0] != 0);
}

TEST_F(LinesOfTwoKeyframes, AreStillWhereTheySlideAlongThemselves) {
  // Ends of segments are not repeatable, so this cannot be told.
  put_level_edge();
  const LineFeatures before = look(SE3());
  shift(0, {0.03, 0.0, 0.0});
  const LineMotion motion = compare(before, look(SE3()), SE3());
  EXPECT_TRUE(motion.matched[0] != 0 && motion.dynamic[0] == 0);
  EXPECT_EQ(motion.weight[0], 1.0);
}

TEST_F(LinesOfTwoKeyframes, HaveTheWeightOfTheirResidual) {
  put_level_edge();
  const LineFeatures before = look(SE3());
  LineFeatures now = before;
  // Both segments have the same ends, so both measure the distance with sqrt(2) sigma: for 4.8 pixels and
  // sigma = 2, chi2 = 2 (4.8^2 / 8) = 5.76 and d = sqrt(5.76 / 4) = 1.2; d_max = sqrt(16 / 4) = 2.
  LineMotionOptions options;
  options.pixel_sigma = 2.0, options.max_chi2 = 16.0;
  now.segments[0].start.y() += 4.8F, now.segments[0].end.y() += 4.8F;
  LineMotion motion = compare(before, now, SE3(), options);
  EXPECT_EQ(motion.dynamic[0], 0);
  EXPECT_NEAR(motion.weight[0], 0.8, 1e-5);  // single precision of the pixels
  // The weight sinks below the least one before the line counts as dynamic: d = 1.95, weight 0.05.
  now.segments[0].start.y() += 3.0F, now.segments[0].end.y() += 3.0F;
  motion = compare(before, now, SE3(), options);
  EXPECT_EQ(motion.dynamic[0], 0);
  EXPECT_EQ(motion.weight[0], 0.0);
}

TEST_F(LinesOfTwoKeyframes, CountTheNoiseOfTheirOctave) {
  put_level_edge();
  LineFeatures before = look(SE3());
  LineFeatures now = before;
  now.segments[0].start.y() += 8.0F, now.segments[0].end.y() += 8.0F;  // chi2 = 2 * 64 / 2 = 64
  EXPECT_EQ(compare(before, now, SE3()).dynamic[0], 1);
  before.segments[0].octave = now.segments[0].octave = 2;  // 64 / 16 = 4
  EXPECT_EQ(compare(before, now, SE3()).dynamic[0], 0);
}

TEST_F(LinesOfTwoKeyframes, AreNotTakenForMovedWhereAWrongMatchIsToBlame) {
  // Two lines that look alike, 20 pixels apart; the keyframe now shows one of them, and the other one's
  // descriptor is a little nearer.
  put_level_edge();
  LineFeatures before = look(SE3());
  LineFeatures now = before;
  LineSegment other = before.segments[0];
  other.start.y() -= 20.0F, other.end.y() -= 20.0F;
  before.segments.push_back(other);
  before.descriptors.push_back(now.descriptors[0]);
  before.descriptors[0][0] ^= 0xf;
  LineMotionOptions options;
  options.match.ratio = 1.0;  // or the two rivals would not be matched at all
  const LineMotion motion = compare(before, now, SE3(), options);
  EXPECT_TRUE(motion.matched[0] != 0 && motion.dynamic[0] == 0);
  EXPECT_EQ(motion.weight[0], 1.0);
}

TEST_F(LinesOfTwoKeyframes, SayNothingWhereADepthIsNotKnown) {
  put_level_edge();
  LineFeatures before = look(SE3());
  shift(0, {0.0, 0.05, 0.0});
  const LineFeatures now = look(SE3());
  before.segments[0].depth = {};
  LineMotion motion = compare(before, now, SE3());
  EXPECT_TRUE(motion.matched[0] == 0 && motion.dynamic[0] == 0);
  EXPECT_EQ(motion.weight[0], 1.0);
  motion = compare(now, before, SE3());
  EXPECT_TRUE(motion.matched[0] == 0 && motion.dynamic[0] == 0);
}

TEST_F(LinesOfTwoKeyframes, SayNothingWhereTheCarriedLineHasNoImage) {
  const LineFeatures lines = look(SE3());
  Vector6d behind = Vector6d::Zero();
  behind.z() = -5.0;  // the camera passed them all
  EXPECT_EQ(count(compare(lines, lines, SE3::exp(behind)).matched), 0U);
  const SE3 nan(Eigen::Quaterniond::Identity(), Eigen::Vector3d::Constant(kNaN));
  const LineMotion motion = compare(lines, lines, nan);
  EXPECT_EQ(count(motion.matched) + count(motion.dynamic), 0U);
  EXPECT_EQ(motion.weight, std::vector<double>(edges.size(), 1.0));
}

TEST_F(LinesOfTwoKeyframes, BearAKeyframeWithoutLines) {
  const LineFeatures lines = look(SE3());
  EXPECT_TRUE(compare(lines, {}, SE3()).weight.empty());
  const LineMotion motion = compare({}, lines, SE3());
  EXPECT_EQ(count(motion.matched), 0U);
  EXPECT_EQ(motion.weight, std::vector<double>(edges.size(), 1.0));
}

TEST_F(LinesOfTwoKeyframes, AreAllStillWithTheCheckOff) {
  put_level_edge();
  const LineFeatures before = look(SE3());
  shift(0, {0.0, 0.05, 0.0});
  LineMotionOptions options;
  options.check = "off";
  const LineMotion motion = compare(before, look(SE3()), SE3(), options);
  EXPECT_EQ(count(motion.matched) + count(motion.dynamic), 0U);
  EXPECT_EQ(motion.weight, std::vector<double>(edges.size(), 1.0));
}

TEST_F(LinesOfTwoKeyframes, AreJudgedByTheAnglesOfTheirWaysAsThePaperHasIt) {
  const LineFeatures before = look(SE3());
  LineFeatures now = before;
  now.segments[0].start += Eigen::Vector2f(4, 0), now.segments[0].end += Eigen::Vector2f(0, 4);  // pi / 3
  now.segments[1].start += Eigen::Vector2f(4, 0), now.segments[1].end += Eigen::Vector2f(4, 1);
  LineMotionOptions options;
  options.check = "angle";
  const LineMotion motion = compare(before, now, SE3(), options);
  EXPECT_TRUE(motion.matched[0] != 0 && motion.dynamic[0] != 0);
  EXPECT_NEAR(motion.weight[0], 0.5, 1e-5);
  // Angles 0, atan(1/4) and atan(1/8): their mean difference is two thirds of the largest.
  EXPECT_TRUE(motion.matched[1] != 0 && motion.dynamic[1] == 0);
  EXPECT_NEAR(motion.weight[1], std::cos(2.0 / 3.0 * std::atan(0.25)), 1e-5);
  EXPECT_EQ(motion.weight[2], 1.0);
}

TEST_F(LinesOfTwoKeyframes, NeedNoDepthForTheAngles) {
  LineFeatures lines = look(SE3());
  for (LineSegment& s : lines.segments) s.depth = {};
  LineMotionOptions options;
  options.check = "angle";
  EXPECT_EQ(count(compare(lines, lines, SE3(), options).matched), edges.size());
}

}  // namespace
}  // namespace ipl_slam
