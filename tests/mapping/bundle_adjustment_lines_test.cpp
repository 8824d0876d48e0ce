#include "mapping/bundle_adjustment_lines.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include <ceres/gradient_checker.h>
#include <gtest/gtest.h>

#include "mapping/bundle_adjustment_line_cost.hpp"

namespace ipl_slam {
namespace {

using LineObservation = BundleProblem::LineObservation;

const Camera kCamera{.fx = 517.0, .fy = 516.0, .cx = 318.0, .cy = 255.0};
const DepthNoiseOptions kNoise{};

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_()) * 0x1.0p-64;
  }
  Vector6d twist(double size) {
    Vector6d xi;
    for (double& x : xi) x = uniform(-size, size);
    return xi;
  }
  Eigen::Vector3d offset(double size) { return twist(size).head<3>(); }

 private:
  std::mt19937_64 engine_;
};

struct Segment3 {
  Eigen::Vector3d a, b;
};

// The twelve edges of a box, four along each axis.
std::vector<Segment3> edges(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  std::vector<Segment3> out;
  for (int axis = 0; axis < 3; ++axis)
    for (int corner = 0; corner < 4; ++corner) {
      Segment3 edge{low, low};
      edge.a[(axis + 1) % 3] = edge.b[(axis + 1) % 3] =
          corner & 1 ? high[(axis + 1) % 3] : low[(axis + 1) % 3];
      edge.a[(axis + 2) % 3] = edge.b[(axis + 2) % 3] =
          corner & 2 ? high[(axis + 2) % 3] : low[(axis + 2) % 3];
      edge.b[axis] = high[axis];
      out.push_back(edge);
    }
  return out;
}

LineObservation observe(const SE3& T_cw, const Segment3& segment, bool with_depth) {
  const Eigen::Vector3d a = T_cw * segment.a, b = T_cw * segment.b;
  return {.start = kCamera.project(a),
          .end = kCamera.project(b),
          .inverse_start = with_depth ? 1.0 / a.z() : 0.0,
          .inverse_end = with_depth ? 1.0 / b.z() : 0.0};
}

// A room of 60 points and the 24 edges of two boxes seen by eight cameras half a metre apart at most; the
// first two are fixed. Exact observations, two in three with depth; every camera sees another stretch of an
// edge.
struct Scene {
  BundleProblem truth;
  std::vector<Segment3> segments = edges({-1.0, -0.8, 2.0}, {1.0, 0.8, 4.0});

  explicit Scene(int fixed = 2) {
    Random random(21);
    for (int i = 0; i < 8; ++i) truth.poses.push_back({SE3::exp(random.twist(0.25)), i < fixed});
    for (const Segment3& s : edges({-0.4, -0.5, 1.8}, {0.7, 0.3, 3.1})) segments.push_back(s);
    for (const Segment3& s : segments) truth.lines.push_back(*Line3::through(s.a, s.b));
    for (int i = 0; i < 60; ++i)
      truth.points.push_back(
          {random.uniform(-1.0, 1.0), random.uniform(-0.8, 0.8), random.uniform(2.0, 4.0)});
    for (std::uint32_t c = 0; c < truth.poses.size(); ++c) {
      for (std::uint32_t l = 0; l < segments.size(); ++l) add_line(c, l, random);
      for (std::uint32_t p = 0; p < truth.points.size(); ++p) add_point(c, p);
    }
  }

  void add_line(std::uint32_t pose, std::uint32_t line, Random& random) {
    const auto& [a, b] = segments[line];
    const double from = random.uniform(0.0, 0.3), to = random.uniform(0.7, 1.0);
    LineObservation o =
        observe(truth.poses[pose].T_cw, {a + from * (b - a), a + to * (b - a)}, (pose + line) % 3 != 0);
    o.pose = pose, o.line = line;
    truth.line_observations.push_back(o);
  }

  void add_point(std::uint32_t pose, std::uint32_t point) {
    const Eigen::Vector3d p_c = truth.poses[pose].T_cw * truth.points[point];
    truth.observations.push_back({.pose = pose,
                                  .point = point,
                                  .uv = kCamera.project(p_c),
                                  .depth = (pose + point) % 3 == 0 ? 0.0 : p_c.z()});
  }

  // Free poses some 2 cm and 1 degree off, points and both ends of every segment 5 cm.
  [[nodiscard]] BundleProblem disturbed() const {
    Random random(4);
    BundleProblem problem = truth;
    for (auto& pose : problem.poses)
      if (!pose.fixed) pose.T_cw = SE3::exp(random.twist(0.02)) * pose.T_cw;
    for (auto& point : problem.points) point += random.offset(0.05);
    for (std::size_t i = 0; i < segments.size(); ++i)
      problem.lines[i] =
          *Line3::through(segments[i].a + random.offset(0.05), segments[i].b + random.offset(0.05));
    return problem;
  }

  [[nodiscard]] BundleProblem disturbed_without_points() const {
    BundleProblem problem = disturbed();
    problem.points.clear();
    problem.observations.clear();
    return problem;
  }

  // How far the ends of a segment lie from its line, m.
  [[nodiscard]] double line_error(const BundleProblem& problem, std::size_t line) const {
    return std::max(problem.lines[line].distance(segments[line].a),
                    problem.lines[line].distance(segments[line].b));
  }
  [[nodiscard]] double line_error(const BundleProblem& problem) const {
    double worst = 0.0;
    for (std::size_t i = 0; i < segments.size(); ++i) worst = std::max(worst, line_error(problem, i));
    return worst;
  }
  [[nodiscard]] double pose_error(const BundleProblem& problem) const {
    double worst = 0.0;
    for (std::size_t i = 0; i < truth.poses.size(); ++i)
      worst = std::max(worst, (problem.poses[i].T_cw * truth.poses[i].T_cw.inverse()).log().norm());
    return worst;
  }
};

bool same_bytes(const BundleProblem& a, const BundleProblem& b) {
  const auto same_pose = [](const auto& p, const auto& q) {
    return p.T_cw.rotation().coeffs() == q.T_cw.rotation().coeffs() &&
           p.T_cw.translation() == q.T_cw.translation();
  };
  const auto same_line = [](const Line3& p, const Line3& q) {
    return p.moment == q.moment && p.direction == q.direction;
  };
  return std::equal(a.poses.begin(), a.poses.end(), b.poses.begin(), b.poses.end(), same_pose) &&
         std::equal(a.lines.begin(), a.lines.end(), b.lines.begin(), b.lines.end(), same_line) &&
         a.points == b.points;
}

BundleResult adjust(BundleProblem& problem, const BundleOptions& options = {},
                    const std::atomic<bool>* abort = nullptr) {
  return adjust_bundle(problem, kCamera, kNoise, options, abort);
}

int count(const std::vector<std::uint8_t>& flags) {
  return static_cast<int>(std::count(flags.begin(), flags.end(), 1));
}

const std::array<LineEnd, 2> kEnds{{{{210.0, 330.0}, 0.45, 0.04}, {{400.0, 180.0}, 0.31, 0.04}}};

template <int kRows>
void expect_right_jacobians(const Line3& line_c) {
  Random random(9);
  const SE3 T_cw = SE3::exp(random.twist(0.7));
  const LineCost<kRows> cost(kCamera, kEnds, 1.7, 0.6);
  const SE3Manifold pose_manifold;
  const Line3Manifold line_manifold;
  const std::vector<const ceres::Manifold*> manifolds = {&pose_manifold, &line_manifold};
  const ceres::GradientChecker checker(&cost, &manifolds, ceres::NumericDiffOptions{});
  double pose[kPoseBlockSize], line[kLineBlockSize];
  to_pose_block(T_cw, pose);
  to_line_block(T_cw.inverse() * line_c, line);
  const double* blocks[] = {pose, line};
  ceres::GradientChecker::ProbeResults results;
  // Whole matrices are compared: Probe's own verdict goes component by component and stumbles over zeros.
  // Ceres' Ridders differences are good to about 1e-10.
  checker.Probe(blocks, 1e-6, &results);
  for (const int block : {0, 1}) {
    const ceres::Matrix& numeric = results.local_numeric_jacobians.at(static_cast<std::size_t>(block));
    EXPECT_GT(numeric.norm(), 1.0);
    EXPECT_LT((results.local_jacobians.at(static_cast<std::size_t>(block)) - numeric).norm(),
              1e-8 * numeric.norm())
        << block;
  }
}

TEST(LineCost, analytic_jacobians_agree_with_numeric_differentiation) {
  for (const Line3& line_c : {*Line3::through({-0.5, 0.4, 2.0}, {0.6, -0.3, 3.0}),
                              *Line3::through({-2.0, 1.0, 4.0}, {2.0, -1.5, 3.5})}) {
    expect_right_jacobians<2>(line_c);
    expect_right_jacobians<3>(line_c);
    expect_right_jacobians<4>(line_c);
  }
}

TEST(LineCost, is_the_residual_in_standard_deviations_times_the_root_of_the_weight) {
  // A horizontal line 2 m ahead, which shows in row cy + 25.8.
  const Line3 line = *Line3::through({-1.0, 0.1, 2.0}, {1.0, 0.1, 2.0});
  const double row = kCamera.cy + 0.05 * kCamera.fy;
  const LineCost<4> cost(kCamera, {{{{300.0, row + 3.0}, 0.6, 0.02}, {{400.0, row - 1.0}, 0.5, 0.02}}}, 4.0,
                         0.25);
  double pose[kPoseBlockSize], block[kLineBlockSize], residual[4];
  to_pose_block(SE3(), pose);
  to_line_block(line, block);
  const double* blocks[] = {pose, block};
  ASSERT_TRUE(cost.Evaluate(blocks, residual, nullptr));
  EXPECT_NEAR(residual[0], 0.5 * 3.0 / 2.0, 1e-12);
  EXPECT_NEAR(residual[1], -0.5 * 1.0 / 2.0, 1e-12);
  // Off the line by some pixels, the depth is that of the line's point nearest to the ray.
  EXPECT_NEAR(residual[2], 0.5 * 0.1 / 0.02, 1e-2);
  EXPECT_NEAR(residual[3], 0.0, 1e-2);
}

TEST(LineCost, a_line_that_does_not_show_at_its_end_points_has_a_large_constant_cost) {
  double pose[kPoseBlockSize], line[kLineBlockSize], residual[4], d_pose[28], d_line[24];
  to_pose_block(SE3(), pose);
  const LineCost<4> cost(kCamera, kEnds, 1.0, 1.0);
  const Line3 behind = *Line3::through({-1.0, 0.1, -2.0}, {1.0, 0.1, -2.0});
  const Line3 through_the_centre = *Line3::through({0.0, 0.0, 0.0}, {1.0, 0.1, 2.0});
  const Line3 in_the_plane_of_the_camera = *Line3::through({-1.0, 1.0, 0.0}, {1.0, 1.0, 0.0});
  for (const Line3& wrong : {behind, through_the_centre, in_the_plane_of_the_camera}) {
    to_line_block(wrong, line);
    const double* blocks[] = {pose, line};
    double* jacobians[] = {d_pose, d_line};
    ASSERT_TRUE(cost.Evaluate(blocks, residual, jacobians));
    EXPECT_NEAR(Eigen::Map<Eigen::Vector4d>(residual).squaredNorm(), kBehindCameraChi2, 1e-6);
    EXPECT_EQ((Eigen::Map<Eigen::Matrix<double, 28, 1>>(d_pose).norm()), 0.0);
    EXPECT_EQ((Eigen::Map<Eigen::Matrix<double, 24, 1>>(d_line).norm()), 0.0);
  }
}

TEST(BundleAdjustmentWithLines, brings_disturbed_poses_points_and_lines_back) {
  const Scene scene;
  BundleProblem problem = scene.disturbed();
  const BundleResult result = adjust(problem);
  // Without noise the minimum is exact; Ceres stops when a step gains less than a millionth of the cost.
  EXPECT_LT(scene.pose_error(problem), 1e-6);
  EXPECT_LT(scene.line_error(problem), 1e-6);
  for (std::size_t i = 0; i < problem.points.size(); ++i)
    EXPECT_LT((problem.points[i] - scene.truth.points[i]).norm(), 1e-6);
  EXPECT_LT(result.final_cost, 1e-6 * result.initial_cost);
  EXPECT_EQ(count(result.outlier) + count(result.line_outlier), 0);
  EXPECT_EQ(result.line_outlier.size(), problem.line_observations.size());
}

TEST(BundleAdjustmentWithLines, lines_in_three_directions_alone_fix_the_poses) {
  const Scene scene;
  BundleProblem problem = scene.disturbed_without_points();
  EXPECT_EQ(count(adjust(problem).line_outlier), 0);
  EXPECT_LT(scene.pose_error(problem), 1e-5);
  EXPECT_LT(scene.line_error(problem), 1e-5);
}

TEST(BundleAdjustmentWithLines, leaves_fixed_poses_untouched_to_the_last_byte) {
  const Scene scene(8);
  BundleProblem problem = scene.disturbed_without_points();
  adjust(problem);
  EXPECT_EQ(scene.pose_error(problem), scene.pose_error(scene.truth));
  EXPECT_LT(scene.line_error(problem), 1e-6);
}

TEST(BundleAdjustmentWithLines, holds_the_first_pose_where_none_is_fixed) {
  const Scene scene(0);
  BundleProblem problem = scene.disturbed_without_points();
  const SE3 first = problem.poses[0].T_cw;
  adjust(problem);
  EXPECT_EQ(problem.poses[0].T_cw.translation(), first.translation());
  EXPECT_EQ(problem.poses[0].T_cw.rotation().coeffs(), first.rotation().coeffs());
  // The whole scene follows the first pose: relative poses are the true ones.
  const SE3 relative = problem.poses[5].T_cw * first.inverse();
  const SE3 expected = scene.truth.poses[5].T_cw * scene.truth.poses[0].T_cw.inverse();
  EXPECT_LT((relative * expected.inverse()).log().norm(), 1e-5);
}

TEST(BundleAdjustmentWithLines, flags_wrong_observations_of_lines_and_only_those) {
  const Scene scene;
  BundleProblem problem = scene.disturbed();
  std::vector<std::uint8_t> wrong(problem.line_observations.size(), 0);
  for (std::size_t i = 3; i < wrong.size(); i += 11) {
    auto& o = problem.line_observations[i];
    if (i % 2 == 1)
      o.start += Eigen::Vector2d(25.0, -25.0), o.end += Eigen::Vector2d(-40.0, 30.0);  // another edge
    else
      o.inverse_start = 1.0, o.inverse_end = 1.0;  // somebody stands before it
    wrong[i] = 1;
  }
  const BundleResult result = adjust(problem);
  EXPECT_EQ(result.line_outlier, wrong);
  EXPECT_EQ(count(result.outlier), 0);
  // Without outliers the rest is exact again.
  EXPECT_LT(scene.pose_error(problem), 1e-5);
  EXPECT_LT(scene.line_error(problem), 1e-5);
}

TEST(BundleAdjustmentWithLines, a_line_without_inliers_stays_where_it_is) {
  const Scene scene;
  BundleProblem problem = scene.disturbed();
  Random random(8);
  for (auto& o : problem.line_observations)
    if (o.line == 7)
      o.start = {random.uniform(0, 640), random.uniform(0, 480)},
      o.end = {random.uniform(0, 640), random.uniform(0, 480)}, o.inverse_start = o.inverse_end = 0.0;
  const Line3 before = problem.lines[7];
  const BundleResult result = adjust(problem);
  for (std::size_t i = 0; i < problem.line_observations.size(); ++i)
    EXPECT_EQ(result.line_outlier[i], problem.line_observations[i].line == 7 ? 1 : 0) << i;
  EXPECT_EQ(problem.lines[7].moment, before.moment);
  EXPECT_EQ(problem.lines[7].direction, before.direction);
  EXPECT_LT(scene.pose_error(problem), 1e-5);
}

TEST(BundleAdjustmentWithLines, observations_that_cannot_be_used_are_outliers_and_spoil_nothing) {
  const Scene scene;
  BundleProblem problem = scene.disturbed();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  problem.line_observations[0].start.x() = nan;
  problem.line_observations[1].inverse_end = nan;
  problem.line_observations[2].sigma2 = 0.0;
  problem.line_observations[3].weight = 0.0;
  problem.line_observations[4].end.y() = std::numeric_limits<double>::infinity();
  const Line3 behind = *Line3::through({-1.0, 0.0, -3.0}, {1.0, 0.0, -3.0});
  problem.lines[10].moment.setConstant(nan);
  problem.lines[11].direction.setZero();
  problem.lines[12] = behind;
  const BundleResult result = adjust(problem);
  for (std::size_t i = 0; i < problem.line_observations.size(); ++i) {
    const std::uint32_t line = problem.line_observations[i].line;
    EXPECT_EQ(result.line_outlier[i], i < 5 || (line >= 10 && line <= 12) ? 1 : 0) << i;
  }
  EXPECT_LT(scene.pose_error(problem), 1e-6);
  EXPECT_EQ(problem.lines[12].moment, behind.moment);
  EXPECT_TRUE(std::isfinite(result.initial_cost) && std::isfinite(result.final_cost));
}

TEST(BundleAdjustmentWithLines, depth_beyond_the_limit_is_not_used) {
  const Scene scene;
  BundleProblem problem = scene.disturbed();
  // Wrong, but beyond max_depth (10 m): it must neither pull nor count.
  for (auto& o : problem.line_observations)
    if (o.pose % 2 == 1) o.inverse_start = 0.09;
  EXPECT_EQ(count(adjust(problem).line_outlier), 0);
  EXPECT_LT(scene.line_error(problem), 1e-6);
}

TEST(BundleAdjustmentWithLines, depth_fixes_a_line_that_one_camera_sees) {
  Scene scene(8);
  std::erase_if(scene.truth.line_observations,
                [](const auto& o) { return o.pose != 1 || !(o.inverse_start > 0); });
  BundleProblem problem = scene.disturbed_without_points();
  adjust(problem);
  ASSERT_GT(problem.line_observations.size(), 10U);
  for (const auto& o : problem.line_observations)
    EXPECT_LT(scene.line_error(problem, o.line), 1e-6) << o.line;
}

TEST(BundleAdjustmentWithLines, lines_that_are_not_determined_neither_run_away_nor_disturb_the_rest) {
  // Without depth, lines 0 to 7 are seen by one camera only, and 8 to 15 by two in the same place.
  Scene scene;
  scene.truth.poses[3].T_cw = scene.truth.poses[2].T_cw;
  std::erase_if(scene.truth.line_observations, [](const auto& o) { return o.pose == 3; });
  std::erase_if(scene.truth.observations, [](const auto& o) { return o.pose == 3; });
  Random random(2);
  for (std::uint32_t line = 8; line < 24; ++line) scene.add_line(3, line, random);
  std::erase_if(scene.truth.line_observations, [](const auto& o) {
    return (o.line < 8 && o.pose != 2) || (o.line < 16 && o.pose != 2 && o.pose != 3);
  });
  for (auto& o : scene.truth.line_observations)
    if (o.line < 16) o.inverse_start = o.inverse_end = 0.0;

  BundleProblem problem = scene.disturbed();
  const BundleResult result = adjust(problem, {.robust_iterations = 20, .final_iterations = 100});
  EXPECT_EQ(count(result.line_outlier), 0);
  EXPECT_LT(scene.pose_error(problem), 1e-5);
  for (std::size_t line = 0; line < 24; ++line) {
    // They came some 5 cm off and turn into the plane they are seen in; how far away in it nobody knows. Two
    // cameras in one place have some parallax at first, since their poses are disturbed.
    const double limit = line < 8 ? 0.2 : line < 16 ? 0.6 : 1e-5;
    EXPECT_LT(scene.line_error(problem, line), limit) << line;
  }
}

TEST(BundleAdjustmentWithLines, noise_on_lines_without_parallax_spoils_neither_poses_nor_other_lines) {
  // Lines 0 to 7 are seen by two cameras 1 mm apart, without depth: half a pixel of noise leaves their place
  // open.
  Scene scene;
  scene.truth.poses[3].T_cw =
      SE3(Eigen::Quaterniond::Identity(), {0.001, 0.0, 0.0}) * scene.truth.poses[2].T_cw;
  std::erase_if(scene.truth.line_observations, [](const auto& o) { return o.pose == 3 || o.line < 8; });
  std::erase_if(scene.truth.observations, [](const auto& o) { return o.pose == 3; });
  Random random(2);
  for (std::uint32_t line = 0; line < 24; ++line)
    for (const std::uint32_t pose : {2, 3})
      if (line < 8 || pose == 3) scene.add_line(pose, line, random);
  for (std::uint32_t point = 0; point < 60; ++point) scene.add_point(3, point);
  for (auto& o : scene.truth.line_observations) {
    if (o.line >= 8) continue;
    o.start += random.offset(0.5).head<2>(), o.end += random.offset(0.5).head<2>();
    o.inverse_start = o.inverse_end = 0.0;
  }
  BundleProblem problem = scene.disturbed();
  const BundleResult result = adjust(problem, {.robust_iterations = 20, .final_iterations = 100});
  EXPECT_TRUE(std::isfinite(result.final_cost));
  // 60 points and 16 lines outvote half a pixel on 8 lines, which by itself would be worth a millimetre.
  EXPECT_LT(scene.pose_error(problem), 1e-3);
  for (std::size_t line = 0; line < 24; ++line) {
    EXPECT_TRUE(problem.lines[line].moment.allFinite()) << line;
    EXPECT_NEAR(problem.lines[line].direction.norm(), 1.0, 1e-12) << line;
  }
  for (std::size_t line = 8; line < 24; ++line) EXPECT_LT(scene.line_error(problem, line), 1e-3) << line;
}

TEST(BundleAdjustmentWithLines, a_line_through_the_origin_of_the_world_is_a_line_like_any_other) {
  Scene scene(8);
  // The world's origin moves onto the first edge; the start has the edge pass it exactly, and 5 cm off.
  const SE3 T_wn(Eigen::Quaterniond::Identity(), 0.5 * (scene.segments[0].a + scene.segments[0].b));
  const SE3 T_nw = T_wn.inverse();
  for (auto& pose : scene.truth.poses) pose.T_cw = pose.T_cw * T_wn;
  for (auto& segment : scene.segments) segment = {T_nw * segment.a, T_nw * segment.b};
  for (auto& line : scene.truth.lines) line = T_nw * line;
  ASSERT_LT(scene.truth.lines[0].moment.norm(), 1e-12);
  for (const double turn : {0.0, 0.1}) {
    BundleProblem problem = scene.disturbed_without_points();
    const auto& [a, b] = scene.segments[0];
    problem.lines[0] = *Line3::through(a + turn * Eigen::Vector3d(0.0, 1.0, -1.0),
                                       b - turn * Eigen::Vector3d(0.0, 1.0, -1.0));
    EXPECT_EQ(count(adjust(problem).line_outlier), 0);
    EXPECT_LT(scene.line_error(problem), 1e-6);
  }
}

TEST(BundleAdjustmentWithLines, the_weight_of_an_observation_matters) {
  const auto shift_with_weight = [](double weight) {
    const Scene scene(8);
    BundleProblem problem = scene.truth;
    for (auto& o : problem.line_observations) {
      o.inverse_start = o.inverse_end = 0.0;
      if (o.pose % 2 == 0) o.start.array() += 1.0, o.end.array() += 1.0, o.weight = weight;
    }
    adjust(problem);
    return scene.line_error(problem);
  };
  EXPECT_LT(shift_with_weight(0.01), 0.1 * shift_with_weight(1.0));
}

TEST(BundleAdjustmentWithLines, lines_that_nobody_sees_change_nothing_to_the_last_byte) {
  BundleProblem with = Scene().disturbed(), without = with;
  for (auto& o : with.line_observations) o.weight = 0.0;
  without.line_observations.clear();
  const std::vector<Line3> lines = with.lines;
  const BundleResult a = adjust(with), b = adjust(without);
  EXPECT_TRUE(same_bytes(with, without));
  EXPECT_EQ(a.final_cost, b.final_cost);
  EXPECT_EQ(a.outlier, b.outlier);
  for (std::size_t i = 0; i < lines.size(); ++i) EXPECT_EQ(with.lines[i].moment, lines[i].moment);
}

TEST(BundleAdjustmentWithLines, gives_the_same_bytes_twice) {
  BundleProblem first = Scene().disturbed(), second = first;
  EXPECT_EQ(adjust(first).line_outlier, adjust(second).line_outlier);
  EXPECT_TRUE(same_bytes(first, second));
}

TEST(BundleAdjustmentWithLines, an_abort_before_the_start_changes_nothing) {
  BundleProblem problem = Scene().disturbed();
  const BundleProblem before = problem;
  const std::atomic<bool> abort = true;
  const BundleResult result = adjust(problem, {}, &abort);
  EXPECT_TRUE(result.aborted);
  EXPECT_EQ(result.line_outlier.size(), problem.line_observations.size());
  EXPECT_TRUE(same_bytes(problem, before));
}

TEST(BundleAdjustmentWithLines, an_index_that_points_nowhere_is_refused) {
  BundleProblem problem = Scene().truth;
  problem.line_observations[3].line = 24;
  EXPECT_THROW(adjust(problem), std::out_of_range);
  problem.line_observations[3].line = 0;
  problem.line_observations[3].pose = 8;
  EXPECT_THROW(adjust(problem), std::out_of_range);
}

}  // namespace
}  // namespace ipl_slam
