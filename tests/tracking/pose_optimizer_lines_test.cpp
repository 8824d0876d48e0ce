#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "common/random.hpp"
#include "tracking/pose_optimizer.hpp"

namespace ipl_slam {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNoise = 0.5;  // px across a line

const Camera kCamera{.fx = 517.0, .fy = 516.0, .cx = 318.0, .cy = 255.0};
const SE3 kTrue = SE3::exp((Vector6d() << 0.4, -0.2, 1.0, 0.3, -0.5, 0.2).finished());
// 3 cm and 2 degrees off: what a constant-velocity prediction can miss.
const Vector6d kOff = (Vector6d() << 0.03, -0.02, 0.03, 0.02, 0.03, -0.02).finished();
const SE3 kStart = SE3::exp(kOff) * kTrue;

// The line through two points of the camera's frame, seen at them with some noise.
LineMatch seen(const Eigen::Vector3d& a_c, const Eigen::Vector3d& b_c, Random* random = nullptr) {
  const SE3 T_wc = kTrue.inverse();
  LineMatch m{.line_w = *Line3::through(T_wc * a_c, T_wc * b_c),
              .start = kCamera.project(a_c),
              .end = kCamera.project(b_c)};
  m.sigma2 = kNoise * kNoise;
  if (random != nullptr) {
    for (Eigen::Vector2d* uv : {&m.start, &m.end}) {
      const double du = random->normal(0.0, kNoise), dv = random->normal(0.0, kNoise);
      *uv += Eigen::Vector2d(du, dv);
    }
  }
  return m;
}

// The twelve edges of a box of 3 x 2 x 2 m before the camera, turned a little.
std::vector<LineMatch> box_edges(Random* random = nullptr) {
  const SE3 T_cb = SE3::exp((Vector6d() << 0.2, -0.1, 4.0, 0.3, 0.5, 0.1).finished());
  std::vector<LineMatch> lines;
  const Eigen::Vector3d half(1.5, 1.0, 1.0);
  for (int axis = 0; axis < 3; ++axis) {
    for (int side = 0; side < 4; ++side) {
      Eigen::Vector3d a = half;
      if (side & 1) a[(axis + 1) % 3] *= -1.0;
      if (side & 2) a[(axis + 2) % 3] *= -1.0;
      Eigen::Vector3d b = a;
      b[axis] *= -1.0;
      lines.push_back(seen(T_cb * a, T_cb * b, random));
    }
  }
  return lines;
}

std::vector<PointMatch> some_points(int count, Random* random = nullptr) {
  Random places(11);
  std::vector<PointMatch> points;
  for (int i = 0; i < count; ++i) {
    PointMatch m;
    const double u = places.uniform(0, 640), v = places.uniform(0, 480);
    m.point_w = kTrue.inverse() * kCamera.unproject({u, v}, places.uniform(0.8, 4.0));
    m.uv = {u, v};
    if (random != nullptr) {
      const double du = random->normal(), dv = random->normal();
      m.uv += Eigen::Vector2d(du, dv);
    }
    points.push_back(m);
  }
  return points;
}

PoseEstimate optimize(const std::vector<PointMatch>& points, const std::vector<LineMatch>& lines,
                      const SE3& start = kStart) {
  return PoseOptimizer(kCamera, {}, {}).optimize(start, points, lines);
}

Vector6d error(const SE3& T_cw) {
  return (T_cw * kTrue.inverse()).log();
}

void expect_start_value(const PoseEstimate& estimate, std::size_t lines) {
  EXPECT_EQ(estimate.T_cw.rotation().coeffs(), kStart.rotation().coeffs());
  EXPECT_EQ(estimate.T_cw.translation(), kStart.translation());
  EXPECT_EQ(estimate.line_inliers, 0);
  EXPECT_EQ(estimate.line_inlier, std::vector<std::uint8_t>(lines, 0));
  EXPECT_EQ(estimate.information, Matrix6d::Zero());
}

TEST(PoseOptimizerLines, ExactLinesAloneGiveTheExactPose) {
  const PoseEstimate estimate = optimize({}, box_edges());
  EXPECT_LT(error(estimate.T_cw).norm(), 1e-9);
  EXPECT_EQ(estimate.line_inliers, 12);
  EXPECT_EQ(estimate.line_inlier, std::vector<std::uint8_t>(12, 1));
  EXPECT_EQ(estimate.inliers, 0);
}

TEST(PoseOptimizerLines, NoisyEdgesOfABoxGiveThePoseAndItsPrecision) {
  // As for points: the mean of e^T Information e is 6 for a consistent estimate, with a deviation of 0.5 over
  // fifty draws; the 5 % of lines that the sorting rejects shift it by some percent.
  double sum = 0.0;
  for (std::uint64_t draw = 0; draw < 50; ++draw) {
    Random random(draw);
    const PoseEstimate estimate = optimize({}, box_edges(&random));
    EXPECT_GE(estimate.line_inliers, 8) << draw;
    const Vector6d e = error(estimate.T_cw);
    EXPECT_LT(e.norm(), 0.02) << draw;  // half a pixel at 4 m is 4 mm
    sum += e.dot(estimate.information * e);
  }
  EXPECT_GT(sum / 50.0, 4.0);
  EXPECT_LT(sum / 50.0, 8.5);
}

TEST(PoseOptimizerLines, PointsAndLinesTogetherAreBetterThanPointsAlone) {
  double alone = 0.0, together = 0.0;
  for (std::uint64_t draw = 0; draw < 30; ++draw) {
    Random random(200 + draw);
    const std::vector<PointMatch> points = some_points(12, &random);
    const std::vector<LineMatch> lines = box_edges(&random);
    alone += error(optimize(points, {}).T_cw).squaredNorm();
    together += error(optimize(points, lines).T_cw).squaredNorm();
  }
  EXPECT_LT(std::sqrt(together), 0.6 * std::sqrt(alone));
}

TEST(PoseOptimizerLines, WrongLinesAreSortedOut) {
  std::vector<LineMatch> lines = box_edges();
  lines[3].start += Eigen::Vector2d(15.0, 12.0);
  lines[7].start += Eigen::Vector2d(-20.0, 25.0);
  lines[7].end += Eigen::Vector2d(-20.0, 25.0);
  for (const std::vector<PointMatch>& points : {std::vector<PointMatch>{}, some_points(20)}) {
    const PoseEstimate estimate = optimize(points, lines);
    EXPECT_LT(error(estimate.T_cw).norm(), 1e-8);
    EXPECT_EQ(estimate.line_inliers, 10);
    EXPECT_EQ(estimate.line_inlier[3], 0);
    EXPECT_EQ(estimate.line_inlier[7], 0);
    EXPECT_EQ(estimate.inliers, static_cast<int>(points.size()));
  }
}

TEST(PoseOptimizerLines, AnEndPointMayLieAnywhereAlongTheLine) {
  std::vector<LineMatch> lines = box_edges();
  for (LineMatch& m : lines) {
    const Eigen::Vector2d along = m.end - m.start;
    m.start += 0.3 * along, m.end -= 0.2 * along;
  }
  const PoseEstimate estimate = optimize({}, lines);
  EXPECT_LT(error(estimate.T_cw).norm(), 1e-9);
  EXPECT_EQ(estimate.line_inliers, 12);
}

TEST(PoseOptimizerLines, ParallelLinesLeaveTheirOwnDirectionWhereItStarted) {
  for (const Eigen::Vector3d& direction :
       {Eigen::Vector3d(1.0, 0.0, 0.0), Eigen::Vector3d(0.0, 0.0, 1.0), Eigen::Vector3d(0.6, 0.64, 0.48)}) {
    Random random(5);
    std::vector<LineMatch> lines;
    for (int i = 0; i < 20; ++i) {
      const double x = random.uniform(-1, 1), y = random.uniform(-1, 1);
      const Eigen::Vector3d middle(x, y, random.uniform(2, 4));
      lines.push_back(seen(middle - 0.5 * direction, middle + 0.5 * direction));
    }
    const PoseEstimate estimate = optimize({}, lines);
    EXPECT_EQ(estimate.line_inliers, 20);
    const Vector6d e = error(estimate.T_cw);
    ASSERT_TRUE(e.allFinite());
    // Turned right, and moved right across the lines; along them it moved only as the turn makes it (2
    // degrees of the first 5 cm).
    EXPECT_LT(e.tail<3>().norm(), 1e-6);
    EXPECT_LT(e.head<3>().cross(direction).norm(), 1e-6);
    const double moved = (estimate.T_cw * kStart.inverse()).log().head<3>().dot(direction);
    EXPECT_LT(std::abs(moved), 0.01) << direction.transpose();

    const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(estimate.information);
    EXPECT_LT(eigen.eigenvalues()[0], 1e-9 * eigen.eigenvalues()[5]) << "one direction is not seen";
    EXPECT_GT(eigen.eigenvalues()[1], 1e-9 * eigen.eigenvalues()[5]) << "but only one";
    EXPECT_GT(std::abs(eigen.eigenvectors().col(0).head<3>().dot(direction)), 0.999);
  }
}

TEST(PoseOptimizerLines, ALineThroughTheCentreOrBehindTheCameraIsAnOutlier) {
  std::vector<LineMatch> lines = box_edges();
  const Eigen::Vector3d a(0.1, 0.2, 1.0);
  LineMatch end_on = seen(a, 2.0 * a);
  end_on.end = end_on.start + Eigen::Vector2d(0.0, 30.0);
  lines.push_back(end_on);
  // Mirrored through the camera's centre: the same image line, but nothing could be seen of it.
  LineMatch behind = seen({-0.5, 0.2, 2.0}, {0.5, 0.1, 2.0});
  const SE3 T_wc = kTrue.inverse();
  behind.line_w =
      *Line3::through(T_wc * Eigen::Vector3d(0.5, -0.2, -2.0), T_wc * Eigen::Vector3d(-0.5, -0.1, -2.0));
  lines.push_back(behind);
  for (const SE3& start : {kStart, kTrue}) {
    const PoseEstimate estimate = optimize({}, lines, start);
    EXPECT_LT(error(estimate.T_cw).norm(), 1e-9);
    EXPECT_EQ(estimate.line_inliers, 12);
    EXPECT_EQ(estimate.line_inlier[12], 0);
    EXPECT_EQ(estimate.line_inlier[13], 0);
  }
  expect_start_value(optimize({}, {behind, behind, behind}), 3);
}

TEST(PoseOptimizerLines, WeightZeroTakesALineOutAndASmallWeightPullsLess) {
  const auto with_weight = [](double weight) {
    std::vector<LineMatch> lines = box_edges();
    lines[2].start.y() += 0.8, lines[2].end.y() += 0.8;  // an inlier still
    lines[2].weight = weight;
    return optimize({}, lines);
  };
  EXPECT_EQ(with_weight(1.0).line_inliers, 12);
  const double full = error(with_weight(1.0).T_cw).norm(), tenth = error(with_weight(0.1).T_cw).norm();
  EXPECT_GT(full, 1e-4);
  EXPECT_LT(tenth, 0.5 * full);
  const PoseEstimate without = with_weight(0.0);
  EXPECT_LT(error(without.T_cw).norm(), 1e-9);
  EXPECT_EQ(without.line_inlier[2], 0);

  std::vector<LineMatch> lines = box_edges();
  for (LineMatch& m : lines) m.weight = 0.0;
  expect_start_value(optimize({}, lines), 12);
}

TEST(PoseOptimizerLines, TheWeightScalesTheInformation) {
  std::vector<LineMatch> lines = box_edges();
  const Matrix6d full = optimize({}, lines).information;
  for (LineMatch& m : lines) m.weight = 0.25;
  EXPECT_LT((optimize({}, lines).information - 0.25 * full).norm(), 1e-6 * full.norm());
}

TEST(PoseOptimizerLines, TheInformationOfPointsAndLinesAddsUp) {
  const Matrix6d points = optimize(some_points(20), {}).information,
                 lines = optimize({}, box_edges()).information;
  const Matrix6d both = optimize(some_points(20), box_edges()).information;
  EXPECT_LT((both - points - lines).norm(), 1e-6 * both.norm());
}

TEST(PoseOptimizerLines, ThreeMatchesOfEitherKindAreEnoughToGoOn) {
  const std::vector<LineMatch> all = box_edges();
  const std::vector<LineMatch> three = {all[0], all[5], all[10]};
  EXPECT_EQ(optimize({}, three).line_inliers, 3);
  const PoseEstimate mixed = optimize(some_points(2), {all[0]});
  EXPECT_EQ(mixed.inliers, 2);
  EXPECT_EQ(mixed.line_inliers, 1);
  expect_start_value(optimize({}, {all[0], all[5]}), 2);
  expect_start_value(optimize(some_points(1), {all[0]}), 1);
}

TEST(PoseOptimizerLines, NumbersThatAreNoneAreOutliersAndSpoilNothing) {
  for (const double bad : {kNan, kInf, -kInf, 1e300}) {
    std::vector<LineMatch> lines = box_edges();
    lines[0].line_w.moment.x() = bad;
    lines[1].line_w.direction.y() = bad;
    lines[2].start.y() = bad;
    lines[3].end.x() = bad;
    lines[4].sigma2 = bad;
    lines[5].weight = bad;
    lines[6].sigma2 = 0.0;
    lines[7].line_w.direction.setZero();
    const PoseEstimate estimate = optimize(some_points(10), lines);
    EXPECT_LT(error(estimate.T_cw).norm(), 1e-9) << bad;
    EXPECT_TRUE(estimate.information.allFinite());
    EXPECT_EQ(estimate.line_inliers, 4);
    for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(estimate.line_inlier[i], 0) << i;
  }
}

// The corner of a room, 3 m away: three edges that meet, of which the camera sees the last metre.
std::vector<LineMatch> corner(Random* random = nullptr) {
  const Eigen::Vector3d meet(0.1, -0.2, 3.0);
  std::vector<LineMatch> lines;
  for (const Eigen::Vector3d& axis : {Eigen::Vector3d(-0.8, 0.2, -0.56), Eigen::Vector3d(0.8, 0.2, -0.56),
                                      Eigen::Vector3d(0.0, 0.95, 0.3)}) {
    lines.push_back(seen(meet, meet + axis, random));
  }
  return lines;
}

// Gives a line the depth at its end points, `error` in 1/m too near.
void measure(LineMatch& m, double sigma, double error = 0.0, Random* random = nullptr) {
  const Line3 line_c = kTrue * m.line_w;
  const auto noise = [&] { return random != nullptr ? random->normal(0.0, sigma) : 0.0; };
  m.inverse_start = inverse_depth_at(kCamera, line_c, m.start) + error + noise();
  m.inverse_end = inverse_depth_at(kCamera, line_c, m.end) + error + noise();
  m.sigma_start = m.sigma_end = sigma;
}

TEST(PoseOptimizerLines, DepthTellsHowFarAwayACornerIs) {
  // Three lines through one point fix no distance: scaled about the camera's centre the world looks the same
  // as long as the corner stays on its ray.
  const SE3 farther(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.1, -0.2, 3.0) * 0.02);
  const SE3 start = farther * kTrue;
  std::vector<LineMatch> lines = corner();
  const PoseEstimate open = optimize({}, lines, start);
  EXPECT_EQ(open.line_inliers, 3);
  EXPECT_GT(error(open.T_cw).norm(), 0.03) << "the image alone leaves it where it was";

  for (LineMatch& m : lines) measure(m, 0.01);
  const PoseEstimate closed = optimize({}, lines, start);
  EXPECT_EQ(closed.line_inliers, 3);
  EXPECT_LT(error(closed.T_cw).norm(), 1e-6);
  EXPECT_EQ(Eigen::FullPivLU<Matrix6d>(closed.information).setThreshold(1e-9).rank(), 6);
}

TEST(PoseOptimizerLines, DepthAtOneEndCounts) {
  std::vector<LineMatch> lines = corner();
  for (LineMatch& m : lines) {
    measure(m, 0.01);
    m.inverse_end = 0.0;
  }
  const SE3 farther(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.1, -0.2, 3.0) * 0.02);
  EXPECT_LT(error(optimize({}, lines, farther * kTrue).T_cw).norm(), 1e-6);
}

TEST(PoseOptimizerLines, NoisyDepthGivesThePoseAndItsPrecision) {
  // As without depth; here the precision along the view is that of depth alone.
  double sum = 0.0;
  for (std::uint64_t draw = 0; draw < 50; ++draw) {
    Random random(400 + draw);
    std::vector<LineMatch> lines;
    for (int i = 0; i < 4; ++i) {
      for (LineMatch& m : corner(&random)) {
        measure(m, 0.005, 0.0, &random);
        lines.push_back(m);
      }
    }
    const Vector6d e = error(optimize({}, lines).T_cw);
    sum += e.dot(optimize({}, lines).information * e);
  }
  EXPECT_GT(sum / 50.0, 4.0);
  EXPECT_LT(sum / 50.0, 8.5);
}

TEST(PoseOptimizerLines, OnlyGrosslyWrongDepthMakesAnOutlier) {
  // As for points, chi-square is that of all components: 9.488 for four. Two depths that are both off by 1.5
  // deviations make 4.5, by 4 deviations 32.
  const auto with_error = [](double deviations) {
    std::vector<LineMatch> lines = box_edges();
    for (LineMatch& m : lines) measure(m, 0.01);
    measure(lines[5], 0.01, 0.01 * deviations);
    return optimize({}, lines);
  };
  EXPECT_EQ(with_error(1.5).line_inlier[5], 1);
  const PoseEstimate gross = with_error(4.0);
  EXPECT_EQ(gross.line_inlier[5], 0);
  EXPECT_EQ(gross.line_inliers, 11);
  EXPECT_LT(error(gross.T_cw).norm(), 1e-6) << "and then it does not pull";
}

TEST(PoseOptimizerLines, DepthThatIsNoneOrOutOfRangeChangesNoBit) {
  Random random(21), again(21);
  const PoseEstimate without = optimize(some_points(5), box_edges(&random));
  std::vector<LineMatch> lines = box_edges(&again);
  const double none[] = {0.0, -0.5, 0.05, 200.0};  // unknown; 20 m away; 5 mm away
  for (std::size_t i = 0; i < lines.size(); ++i) {
    lines[i].inverse_start = none[i % 4], lines[i].inverse_end = none[(i + 1) % 4];
    lines[i].sigma_start = lines[i].sigma_end = 0.01;
  }
  const PoseEstimate with = optimize(some_points(5), lines);
  EXPECT_EQ(with.T_cw.translation(), without.T_cw.translation());
  EXPECT_EQ(with.T_cw.rotation().coeffs(), without.T_cw.rotation().coeffs());
  EXPECT_EQ(with.information, without.information);
  EXPECT_EQ(with.line_inlier, without.line_inlier);
}

TEST(PoseOptimizerLines, DepthWithoutADeviationHasThatOfTheCamera) {
  std::vector<LineMatch> camera_s = corner(), own = corner();
  for (LineMatch& m : camera_s) measure(m, 0.0);
  for (LineMatch& m : own) measure(m, DepthNoiseOptions{}.inverse_depth_sigma);
  EXPECT_EQ(optimize({}, camera_s).information, optimize({}, own).information);
}

TEST(PoseOptimizerLines, DepthThatIsNoNumberIsAnOutlier) {
  for (const double bad : {kNan, kInf, -kInf}) {
    std::vector<LineMatch> lines = box_edges();
    lines[0].inverse_start = bad;
    lines[1].inverse_end = bad;
    lines[2].sigma_start = bad;
    lines[3].sigma_end = bad;
    const PoseEstimate estimate = optimize({}, lines);
    EXPECT_LT(error(estimate.T_cw).norm(), 1e-9) << bad;
    EXPECT_EQ(estimate.line_inliers, 8);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(estimate.line_inlier[i], 0) << i;
  }
}

TEST(PoseOptimizerLines, GivesTheSameBytesTwice) {
  Random random(9), again(9);
  const PoseEstimate a = optimize(some_points(15), box_edges(&random)),
                     b = optimize(some_points(15), box_edges(&again));
  EXPECT_EQ(a.T_cw.rotation().coeffs(), b.T_cw.rotation().coeffs());
  EXPECT_EQ(a.T_cw.translation(), b.T_cw.translation());
  EXPECT_EQ(a.information, b.information);
  EXPECT_EQ(a.line_inlier, b.line_inlier);
}

}  // namespace
}  // namespace ipl_slam
