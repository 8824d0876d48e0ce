#include "tracking/pose_optimizer.hpp"

#include <cmath>
#include <limits>
#include <random>

#include <Eigen/LU>
#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

const Camera kCamera{.fx = 517.0, .fy = 516.0, .cx = 318.0, .cy = 255.0};
const DepthNoiseOptions kNoise{};
const SE3 kTrue = SE3::exp((Vector6d() << 0.4, -0.2, 1.0, 0.3, -0.5, 0.2).finished());
// 3 cm and 2 degrees off, some 20 to 30 pixels: what a constant-velocity prediction can miss.
const SE3 kStart = SE3::exp((Vector6d() << 0.03, -0.02, 0.03, 0.02, 0.03, -0.02).finished()) * kTrue;

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_()) * 0x1.0p-64;
  }
  double normal() {
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) sum += uniform(0.0, 1.0);
    return sum;
  }

 private:
  std::mt19937_64 engine_;
};

// Exact matches all over the image, every other one with measured depth.
std::vector<PointMatch> exact_matches(int count, bool with_depth = true) {
  Random random(11);
  std::vector<PointMatch> matches;
  for (int i = 0; i < count; ++i) {
    PointMatch m;
    m.uv = {random.uniform(0, 640), random.uniform(0, 480)};
    const double z = random.uniform(0.8, 4.0);
    m.point_w = kTrue.inverse() * kCamera.unproject(m.uv, z);
    if (with_depth && i % 2 == 0) m.depth = z;
    m.sigma2 = std::pow(1.44, i % 8);
    matches.push_back(m);
  }
  return matches;
}

// Moves the first matches tens to hundreds of pixels away, each to somewhere else.
void spoil(std::vector<PointMatch>& matches, std::size_t count) {
  Random random(5);
  for (std::size_t i = 0; i < count; ++i) {
    const double angle = random.uniform(0.0, 6.28), far = random.uniform(40.0, 300.0);
    matches[i].uv += far * Eigen::Vector2d(std::cos(angle), std::sin(angle));
  }
}

PoseEstimate optimize(const std::vector<PointMatch>& matches, const SE3& start = kStart,
                      const PoseOptimizerOptions& options = {}) {
  return PoseOptimizer(kCamera, kNoise, options).optimize(start, matches);
}

double translation_error(const SE3& T_cw) {
  return (T_cw.inverse().translation() - kTrue.inverse().translation()).norm();
}
double distance(const SE3& T_cw) {
  return (T_cw * kTrue.inverse()).log().norm();
}

void expect_start_value(const PoseEstimate& estimate, std::size_t matches) {
  EXPECT_EQ(estimate.T_cw.rotation().coeffs(), kStart.rotation().coeffs());
  EXPECT_EQ(estimate.T_cw.translation(), kStart.translation());
  EXPECT_EQ(estimate.inliers, 0);
  EXPECT_EQ(estimate.inlier, std::vector<std::uint8_t>(matches, 0));
  EXPECT_EQ(estimate.information, Matrix6d::Zero());
}

TEST(PoseOptimizer, recovers_the_exact_pose_from_exact_matches) {
  for (const bool with_depth : {false, true}) {
    const PoseEstimate estimate = optimize(exact_matches(100, with_depth));
    EXPECT_LT(distance(estimate.T_cw), 1e-9) << with_depth;  // the last step is below 1e-10 m or rad or so
    EXPECT_EQ(estimate.inliers, 100);
  }
}

TEST(PoseOptimizer, needs_no_more_than_three_matches_with_depth) {
  std::vector<PointMatch> matches = exact_matches(6);
  const std::vector<PointMatch> three = {matches[0], matches[2], matches[4]};
  const PoseEstimate estimate = optimize(three);
  EXPECT_LT(distance(estimate.T_cw), 1e-8);
  EXPECT_EQ(estimate.inliers, 3);
}

TEST(PoseOptimizer, finds_pose_and_outliers_among_forty_percent_of_wrong_matches) {
  std::vector<PointMatch> matches = exact_matches(200);
  spoil(matches, 80);
  const PoseEstimate estimate = optimize(matches);
  EXPECT_LT(distance(estimate.T_cw), 1e-9);
  EXPECT_EQ(estimate.inliers, 120);
  for (std::size_t i = 0; i < matches.size(); ++i) EXPECT_EQ(estimate.inlier[i], i < 80 ? 0 : 1) << i;
}

TEST(PoseOptimizer, averages_noise_and_states_its_own_precision) {
  // Fifty draws of noise: the mean of e^T Information e of a consistent estimate is 6, the degrees of freedom
  // of a pose. Its standard deviation over fifty draws is sqrt(12 / 50) = 0.5; the 5 % of matches that the
  // sorting rejects shift it by a few percent.
  double sum = 0.0;
  for (std::uint64_t draw = 0; draw < 50; ++draw) {
    Random random(100 + draw);
    std::vector<PointMatch> matches = exact_matches(150);
    for (PointMatch& m : matches) {
      const double sigma = std::sqrt(m.sigma2);
      const double du = random.normal(), dv = random.normal();
      m.uv += sigma * Eigen::Vector2d(du, dv);
      if (m.depth > 0.0) m.depth = 1.0 / (1.0 / m.depth + kNoise.inverse_depth_sigma * random.normal());
    }
    const PoseEstimate estimate = optimize(matches);
    EXPECT_GT(estimate.inliers, 125);
    const Vector6d error = (estimate.T_cw * kTrue.inverse()).log();
    sum += error.dot(estimate.information * error);
  }
  EXPECT_GT(sum / 50.0, 4.0);
  EXPECT_LT(sum / 50.0, 8.5);
}

TEST(PoseOptimizer, sorts_matches_that_become_inliers_only_once_the_pose_is_right) {
  // Measured depth makes most matches fail the test at the start value, which is 25 pixels off.
  const std::vector<PointMatch> matches = exact_matches(50);
  EXPECT_EQ(optimize(matches).inliers, 50);
  PoseOptimizerOptions single;
  single.rounds = 1;
  single.iterations = 1;
  EXPECT_LT(optimize(matches, SE3::exp(Vector6d::Constant(0.1)) * kTrue, single).inliers, 50);
}

TEST(PoseOptimizer, weight_zero_takes_a_match_out) {
  std::vector<PointMatch> matches = exact_matches(100);
  for (std::size_t i = 0; i < 60; ++i) {
    matches[i].uv +=
        Eigen::Vector2d(30.0, 10.0);  // one motion together: a majority that only the weight can beat
    matches[i].weight = 0.0;
  }
  const PoseEstimate estimate = optimize(matches);
  EXPECT_LT(distance(estimate.T_cw), 1e-9);
  EXPECT_EQ(estimate.inliers, 40);
  for (std::size_t i = 0; i < 60; ++i) EXPECT_EQ(estimate.inlier[i], 0) << i;

  for (PointMatch& m : matches) m.weight = 0.0;
  expect_start_value(optimize(matches), matches.size());
}

TEST(PoseOptimizer, a_smaller_weight_pulls_less) {
  // Half the matches say the true pose, half a pose that is shifted by about a pixel; all of them inliers.
  const auto error_with_weight = [](double weight) {
    std::vector<PointMatch> matches = exact_matches(100, false);
    for (std::size_t i = 0; i < 100; ++i) {
      matches[i].sigma2 = 4.0;
      if (i % 2 == 1) matches[i].uv.x() += 1.5, matches[i].weight = weight;
    }
    const PoseEstimate estimate = optimize(matches);
    EXPECT_EQ(estimate.inliers, 100);
    return distance(estimate.T_cw);
  };
  const double full = error_with_weight(1.0), tenth = error_with_weight(0.1),
               hundredth = error_with_weight(0.01);
  // Least squares of two groups of equal geometry: the shift is weight / (1 + weight) of the whole.
  EXPECT_NEAR(tenth / full, (0.1 / 1.1) / 0.5, 0.05);
  EXPECT_NEAR(hundredth / full, (0.01 / 1.01) / 0.5, 0.01);
}

TEST(PoseOptimizer, the_weight_scales_the_information) {
  std::vector<PointMatch> matches = exact_matches(50);
  const Matrix6d full = optimize(matches).information;
  for (PointMatch& m : matches) m.weight = 0.25;
  EXPECT_LT((optimize(matches).information - 0.25 * full).norm(), 1e-6 * full.norm());
}

TEST(PoseOptimizer, points_behind_the_camera_are_outliers) {
  std::vector<PointMatch> matches = exact_matches(60);
  for (std::size_t i = 0; i < 20; ++i) {
    // The mirror image through the camera's centre has the same pixel.
    matches[i].point_w = kTrue.inverse() * Eigen::Vector3d(-(kTrue * matches[i].point_w));
    matches[i].depth = 0.0;
  }
  const PoseEstimate estimate = optimize(matches);
  EXPECT_LT(distance(estimate.T_cw), 1e-9);
  EXPECT_EQ(estimate.inliers, 40);
  for (std::size_t i = 0; i < 20; ++i) EXPECT_EQ(estimate.inlier[i], 0) << i;

  matches.resize(20);
  expect_start_value(optimize(matches), matches.size());
}

TEST(PoseOptimizer, too_few_matches_give_the_start_value_back) {
  const std::vector<PointMatch> matches = exact_matches(2);
  expect_start_value(optimize({}), 0);
  expect_start_value(optimize(matches), 2);
}

TEST(PoseOptimizer, matches_that_agree_on_no_pose_give_the_start_value_back) {
  std::vector<PointMatch> matches = exact_matches(8);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    matches[i].uv = Eigen::Vector2d(i % 2 == 0 ? -4000.0 : 4000.0, i % 3 == 0 ? 5000.0 : -3000.0);
    matches[i].depth = i % 2 == 0 ? 0.3 : 9.0;
  }
  expect_start_value(optimize(matches), matches.size());
}

TEST(PoseOptimizer, numbers_that_are_none_are_outliers_and_spoil_nothing) {
  std::vector<PointMatch> matches = exact_matches(40);
  for (const double bad : {kNan, kInf, -kInf, 1e300}) {
    std::vector<PointMatch> broken = matches;
    broken[0].point_w.x() = bad;
    broken[1].uv.y() = bad;
    broken[2].sigma2 = bad;
    broken[3].weight = bad;
    broken[5].sigma2 = 0.0;
    broken[6].weight = -1.0;
    if (!std::isfinite(bad)) broken[4].depth = bad;
    const PoseEstimate estimate = optimize(broken);
    EXPECT_LT(distance(estimate.T_cw), 1e-9) << bad;
    EXPECT_TRUE(estimate.information.allFinite());
    EXPECT_EQ(estimate.inliers, std::isfinite(bad) ? 34 : 33);
    for (const std::size_t i : {0, 1, 2, 3, 5, 6}) EXPECT_EQ(estimate.inlier[i], 0) << i;
  }
  for (PointMatch& m : matches) m.point_w.z() = kNan;
  expect_start_value(optimize(matches), matches.size());
}

TEST(PoseOptimizer, coinciding_points_leave_a_finite_pose) {
  const std::vector<PointMatch> matches(10,
                                        exact_matches(1, false)[0]);  // four directions are not seen at all
  const PoseEstimate estimate = optimize(matches);
  EXPECT_TRUE(estimate.T_cw.log().allFinite());
  EXPECT_TRUE(estimate.information.allFinite());
  EXPECT_EQ(estimate.inliers, 10);
  EXPECT_LT(distance(estimate.T_cw), 0.2);  // stays where it started in what it cannot know
}

TEST(PoseOptimizer, measured_depth_fixes_the_direction_that_pixels_leave_open) {
  // A single spot of the wall, far away: pixels say hardly anything about the distance to it, depth says all.
  Random random(3);
  std::vector<PointMatch> matches;
  for (int i = 0; i < 200; ++i) {
    PointMatch m;
    const Eigen::Vector2d uv(random.uniform(300, 340), random.uniform(240, 280));
    m.point_w = kTrue.inverse() * kCamera.unproject(uv, 3.0);
    const double du = random.normal(), dv = random.normal();
    m.uv = uv + Eigen::Vector2d(du, dv);
    m.depth = 1.0 / (1.0 / 3.0 + 0.001 * random.normal());
    matches.push_back(m);
  }
  const auto depth_error = [](const SE3& T_cw) {
    return std::abs((T_cw * kTrue.inverse() * Eigen::Vector3d(0, 0, 3)).z() - 3.0);
  };
  const SE3 start = SE3::exp((Vector6d() << 0.0, 0.0, 0.1, 0.0, 0.0, 0.0).finished()) * kTrue;
  const DepthNoiseOptions precise{.inverse_depth_sigma = 0.001};
  const double with = depth_error(PoseOptimizer(kCamera, precise, {}).optimize(start, matches).T_cw);
  // Inverse depth 0.001 1/m off is 9 mm at 3 m; two hundred of them average to 0.6 mm.
  EXPECT_LT(with, 0.003);
  for (PointMatch& m : matches) m.depth = 0.0;
  EXPECT_GT(depth_error(PoseOptimizer(kCamera, precise, {}).optimize(start, matches).T_cw), 5.0 * with);
}

TEST(PoseOptimizer, depth_beyond_the_sensors_range_is_not_used) {
  std::vector<PointMatch> matches = exact_matches(50);
  for (PointMatch& m : matches)
    m.depth = kNoise.max_depth + 0.01;  // wrong for all: the points lie within 4 m
  const PoseEstimate estimate = optimize(matches);
  EXPECT_LT(distance(estimate.T_cw), 1e-9);
  EXPECT_EQ(estimate.inliers, 50);
}

TEST(PoseOptimizer, wrong_depth_alone_makes_an_outlier) {
  std::vector<PointMatch> matches = exact_matches(60);
  matches[0].depth *= 1.5;
  const PoseEstimate estimate = optimize(matches);
  EXPECT_EQ(estimate.inlier[0], 0);
  EXPECT_EQ(estimate.inliers, 59);
  EXPECT_LT(translation_error(estimate.T_cw), 1e-9);
}

TEST(PoseOptimizer, gives_the_same_bytes_twice) {
  std::vector<PointMatch> matches = exact_matches(101);
  spoil(matches, 30);
  const PoseEstimate a = optimize(matches), b = optimize(matches);
  EXPECT_EQ(a.T_cw.rotation().coeffs(), b.T_cw.rotation().coeffs());
  EXPECT_EQ(a.T_cw.translation(), b.T_cw.translation());
  EXPECT_EQ(a.information, b.information);
  EXPECT_EQ(a.inlier, b.inlier);
}

}  // namespace
}  // namespace ipl_slam
