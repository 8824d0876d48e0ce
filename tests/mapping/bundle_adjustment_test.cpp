#include "mapping/bundle_adjustment.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <thread>

#include <ceres/gradient_checker.h>
#include <gtest/gtest.h>

#include "mapping/bundle_adjustment_costs.hpp"

namespace ipl_slam {
namespace {

const Camera kCamera{.fx = 517.0, .fy = 516.0, .cx = 318.0, .cy = 255.0};
const DepthNoiseOptions kNoise{};

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
  Vector6d twist(double size) {
    Vector6d xi;
    for (double& x : xi) x = uniform(-size, size);
    return xi;
  }
  Eigen::Vector3d offset(double size) { return twist(size).head<3>(); }

 private:
  std::mt19937_64 engine_;
};

// A room of 120 points seen by eight cameras half a metre apart at most; the first two are fixed. Exact
// observations, two in three with depth.
struct Scene {
  BundleProblem truth;

  explicit Scene(int fixed = 2) {
    Random random(21);
    for (int i = 0; i < 8; ++i) truth.poses.push_back({SE3::exp(random.twist(0.25)), i < fixed});
    for (int i = 0; i < 120; ++i)
      truth.points.push_back(
          {random.uniform(-1.0, 1.0), random.uniform(-0.8, 0.8), random.uniform(2.0, 4.0)});
    for (std::uint32_t p = 0; p < truth.points.size(); ++p)
      for (std::uint32_t c = 0; c < truth.poses.size(); ++c) observe(c, p);
  }

  void observe(std::uint32_t pose, std::uint32_t point) {
    const Eigen::Vector3d p_c = truth.poses[pose].T_cw * truth.points[point];
    const double depth = (pose + point) % 3 == 0 ? 0.0 : p_c.z();
    truth.observations.push_back({.pose = pose,
                                  .point = point,
                                  .uv = kCamera.project(p_c),
                                  .depth = depth,
                                  .sigma2 = 1.0,
                                  .weight = 1.0});
  }

  // Free poses some 2 cm and 1 degree off, points 5 cm.
  [[nodiscard]] BundleProblem disturbed() const {
    Random random(4);
    BundleProblem problem = truth;
    for (auto& pose : problem.poses)
      if (!pose.fixed) pose.T_cw = SE3::exp(random.twist(0.02)) * pose.T_cw;
    for (auto& point : problem.points) point += random.offset(0.05);
    return problem;
  }
};

double pose_error(const BundleProblem& a, const BundleProblem& b) {
  double worst = 0.0;
  for (std::size_t i = 0; i < a.poses.size(); ++i)
    worst = std::max(worst, (a.poses[i].T_cw * b.poses[i].T_cw.inverse()).log().norm());
  return worst;
}

double point_error(const BundleProblem& a, const BundleProblem& b) {
  double worst = 0.0;
  for (std::size_t i = 0; i < a.points.size(); ++i)
    worst = std::max(worst, (a.points[i] - b.points[i]).norm());
  return worst;
}

bool same_bytes(const SE3& a, const SE3& b) {
  return a.rotation().coeffs() == b.rotation().coeffs() && a.translation() == b.translation();
}

bool same_poses(const BundleProblem& a, const BundleProblem& b) {
  return std::equal(a.poses.begin(), a.poses.end(), b.poses.begin(), b.poses.end(),
                    [](const auto& p, const auto& q) { return same_bytes(p.T_cw, q.T_cw); });
}

BundleResult adjust(BundleProblem& problem, const BundleOptions& options = {},
                    const std::atomic<bool>* abort = nullptr) {
  return adjust_bundle(problem, kCamera, kNoise, options, abort);
}

template <int kRows>
void expect_right_jacobians(const Eigen::Vector3d& p_c) {
  Random random(9);
  const SE3 T_cw = SE3::exp(random.twist(0.7));
  const Eigen::Vector3d p_w = T_cw.inverse() * p_c;
  const BundleProblem::Observation o{.uv = {210.0, 330.0}, .depth = 2.2, .sigma2 = 1.7, .weight = 0.6};
  const PointCost<kRows> cost(kCamera, kNoise, o);
  const SE3Manifold manifold;
  const std::vector<const ceres::Manifold*> manifolds = {&manifold, nullptr};
  const ceres::GradientChecker checker(&cost, &manifolds, ceres::NumericDiffOptions{});
  double pose[kPoseBlockSize];
  to_pose_block(T_cw, pose);
  const double* blocks[] = {pose, p_w.data()};
  ceres::GradientChecker::ProbeResults results;
  // Probe's own verdict compares component by component and stumbles over zeros; whole matrices do not.
  // Ceres' Ridders differences are good to about 1e-10.
  checker.Probe(blocks, 1e-6, &results);
  for (const int block : {0, 1}) {
    const ceres::Matrix& numeric = results.local_numeric_jacobians.at(block);
    EXPECT_GT(numeric.norm(), 1.0);
    EXPECT_LT((results.local_jacobians.at(block) - numeric).norm(), 1e-8 * numeric.norm()) << block;
  }
}

TEST(PointCost, analytic_jacobians_agree_with_numeric_differentiation) {
  expect_right_jacobians<2>({0.4, -0.3, 2.0});
  expect_right_jacobians<3>({0.4, -0.3, 2.0});
  expect_right_jacobians<3>({-2.0, 1.1, 5.0});
}

TEST(PointCost, is_the_residual_in_standard_deviations_times_the_root_of_the_weight) {
  const BundleProblem::Observation o{
      .uv = {kCamera.cx + 3.0, kCamera.cy}, .depth = 2.0, .sigma2 = 4.0, .weight = 0.25};
  const PointCost<3> cost(kCamera, kNoise, o);
  double pose[kPoseBlockSize], residual[3];
  to_pose_block(SE3(), pose);
  const double point[] = {0.0, 0.0, 2.5};
  const double* blocks[] = {pose, point};
  ASSERT_TRUE(cost.Evaluate(blocks, residual, nullptr));
  EXPECT_NEAR(residual[0], 0.5 * 3.0 / 2.0, 1e-12);
  EXPECT_NEAR(residual[1], 0.0, 1e-12);
  EXPECT_NEAR(residual[2], 0.5 * (1.0 / 2.0 - 1.0 / 2.5) / kNoise.inverse_depth_sigma, 1e-12);
}

TEST(PointCost, a_point_behind_the_camera_has_a_large_constant_cost) {
  const BundleProblem::Observation o{.uv = {300.0, 200.0}, .depth = 2.0};
  const PointCost<3> cost(kCamera, kNoise, o);
  double pose[kPoseBlockSize], residual[3], d_pose[21], d_point[9];
  to_pose_block(SE3(), pose);
  const double point[] = {0.1, 0.1, -1.0};
  const double* blocks[] = {pose, point};
  double* jacobians[] = {d_pose, d_point};
  ASSERT_TRUE(cost.Evaluate(blocks, residual, jacobians));
  EXPECT_NEAR(Eigen::Map<Eigen::Vector3d>(residual).squaredNorm(), kBehindCameraChi2, 1e-6);
  EXPECT_EQ((Eigen::Map<Eigen::Matrix<double, 21, 1>>(d_pose).norm()), 0.0);
  EXPECT_EQ((Eigen::Map<Eigen::Matrix<double, 9, 1>>(d_point).norm()), 0.0);
}

TEST(BundleAdjustment, brings_disturbed_poses_and_points_back) {
  const Scene scene;
  BundleProblem problem = scene.disturbed();
  const BundleResult result = adjust(problem);
  // Without noise the minimum is exact; Ceres stops when a step gains less than a millionth of the cost.
  EXPECT_LT(pose_error(problem, scene.truth), 1e-6);
  EXPECT_LT(point_error(problem, scene.truth), 1e-6);
  EXPECT_LT(result.final_cost, 1e-6 * result.initial_cost);
  EXPECT_EQ(std::count(result.outlier.begin(), result.outlier.end(), 1), 0);
  EXPECT_GT(result.iterations, 1);
  EXPECT_FALSE(result.aborted);
}

TEST(BundleAdjustment, leaves_fixed_poses_untouched_to_the_last_byte) {
  const Scene scene;
  BundleProblem problem = scene.disturbed();
  adjust(problem);
  for (int i = 0; i < 2; ++i) EXPECT_TRUE(same_bytes(problem.poses[i].T_cw, scene.truth.poses[i].T_cw));
  for (int i = 2; i < 8; ++i)
    EXPECT_FALSE(same_bytes(problem.poses[i].T_cw, scene.disturbed().poses[i].T_cw));
}

TEST(BundleAdjustment, holds_the_first_pose_where_none_is_fixed) {
  const Scene scene(0);
  BundleProblem problem = scene.disturbed();
  const SE3 first = problem.poses[0].T_cw;
  const BundleResult result = adjust(problem);
  EXPECT_TRUE(same_bytes(problem.poses[0].T_cw, first));
  EXPECT_LT(result.final_cost, 1e-6 * result.initial_cost);
  // The whole scene follows the first pose: relative poses are the true ones.
  const SE3 relative = problem.poses[5].T_cw * first.inverse();
  const SE3 expected = scene.truth.poses[5].T_cw * scene.truth.poses[0].T_cw.inverse();
  EXPECT_LT((relative * expected.inverse()).log().norm(), 1e-6);
}

TEST(BundleAdjustment, moves_points_alone_where_all_poses_are_fixed) {
  const Scene scene(8);
  BundleProblem problem = scene.disturbed();
  adjust(problem);
  EXPECT_LT(point_error(problem, scene.truth), 1e-6);
  EXPECT_TRUE(same_poses(problem, scene.truth));
}

TEST(BundleAdjustment, flags_wrong_observations_and_only_those) {
  const Scene scene;
  BundleProblem problem = scene.disturbed();
  std::vector<std::uint8_t> wrong(problem.observations.size(), 0);
  for (std::size_t i = 3; i < wrong.size(); i += 10) {
    if (i % 20 == 3)
      problem.observations[i].uv += Eigen::Vector2d(40.0, -25.0);
    else
      problem.observations[i].depth = 1.0;
    wrong[i] = 1;
  }
  const BundleResult result = adjust(problem);
  EXPECT_EQ(result.outlier, wrong);
  // Without outliers the rest is exact again.
  EXPECT_LT(pose_error(problem, scene.truth), 1e-5);
  EXPECT_LT(point_error(problem, scene.truth), 1e-5);
}

TEST(BundleAdjustment, a_point_without_inliers_stays_where_it_is) {
  const Scene scene;
  BundleProblem problem = scene.disturbed();
  Random random(8);
  for (auto& o : problem.observations)
    if (o.point == 7) o.uv = {random.uniform(0, 640), random.uniform(0, 480)}, o.depth = 0.0;
  problem.points.push_back({1.0, 2.0, 3.0});  // and one without any observation
  const Eigen::Vector3d before = problem.points[7];
  const BundleResult result = adjust(problem);
  for (std::size_t i = 0; i < problem.observations.size(); ++i)
    EXPECT_EQ(result.outlier[i], problem.observations[i].point == 7 ? 1 : 0);
  EXPECT_EQ(problem.points[7], before);
  EXPECT_EQ(problem.points.back(), Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_LT(pose_error(problem, scene.truth), 1e-5);
}

TEST(BundleAdjustment, observations_that_cannot_be_used_are_outliers_and_spoil_nothing) {
  const Scene scene;
  BundleProblem problem = scene.disturbed();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  problem.observations[0].uv.x() = nan;
  problem.observations[1].depth = nan;
  problem.observations[2].sigma2 = 0.0;
  problem.observations[3].weight = 0.0;
  problem.observations[4].uv.y() = std::numeric_limits<double>::infinity();
  const std::uint32_t lost = 50, behind = 60;
  problem.points[lost].setConstant(nan);
  problem.points[behind] = {0.0, 0.0, -3.0};
  const BundleResult result = adjust(problem);
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    const auto& o = problem.observations[i];
    EXPECT_EQ(result.outlier[i], i < 5 || o.point == lost || o.point == behind ? 1 : 0) << i;
  }
  EXPECT_LT(pose_error(problem, scene.truth), 1e-6);
  EXPECT_EQ(problem.points[behind], Eigen::Vector3d(0.0, 0.0, -3.0));
  EXPECT_TRUE(std::isfinite(result.initial_cost) && std::isfinite(result.final_cost));
}

TEST(BundleAdjustment, depth_fixes_the_scale) {
  // Two cameras, the second free, all observations from both: pixels alone leave the baseline's length open.
  Scene scene(1);
  scene.truth.poses.resize(2);
  std::erase_if(scene.truth.observations, [](const auto& o) { return o.pose > 1; });
  for (auto& o : scene.truth.observations)
    o.depth = (scene.truth.poses[o.pose].T_cw * scene.truth.points[o.point]).z();
  BundleProblem problem = scene.truth;
  // Everything 5 % larger, seen from the first camera.
  const SE3 T_0w = problem.poses[0].T_cw;
  for (auto& p : problem.points) p = T_0w.inverse() * (1.05 * (T_0w * p));
  const SE3 T_10 = problem.poses[1].T_cw * T_0w.inverse();
  problem.poses[1].T_cw = SE3(T_10.rotation(), 1.05 * T_10.translation()) * T_0w;

  BundleProblem without = problem;
  for (auto& o : without.observations) o.depth = 0.0;
  adjust(without);
  EXPECT_GT(point_error(without, scene.truth), 0.1);  // pixels fit, so nothing moves back
  adjust(problem);
  EXPECT_LT(point_error(problem, scene.truth), 1e-5);
}

TEST(BundleAdjustment, the_weight_of_an_observation_matters) {
  // One free point, fixed cameras; half of the observations are shifted by a pixel and a half.
  const auto shift_with_weight = [](double weight) {
    const Scene scene(8);
    BundleProblem problem = scene.truth;
    for (auto& o : problem.observations) {
      o.depth = 0.0;
      if (o.pose % 2 == 0) o.uv.x() += 1.5, o.weight = weight;
    }
    adjust(problem);
    return point_error(problem, scene.truth);
  };
  EXPECT_LT(shift_with_weight(0.01), 0.1 * shift_with_weight(1.0));
}

TEST(BundleAdjustment, an_abort_before_the_start_changes_nothing) {
  const Scene scene;
  BundleProblem problem = scene.disturbed();
  const std::atomic<bool> abort = true;
  const BundleResult result = adjust(problem, {}, &abort);
  EXPECT_TRUE(result.aborted);
  EXPECT_EQ(result.iterations, 0);
  EXPECT_EQ(result.initial_cost, result.final_cost);
  EXPECT_EQ(result.outlier.size(), problem.observations.size());
  EXPECT_TRUE(same_poses(problem, scene.disturbed()));
  EXPECT_EQ(point_error(problem, scene.disturbed()), 0.0);
}

TEST(BundleAdjustment, an_abort_in_between_ends_early_with_a_state_that_is_no_worse) {
  Scene scene;
  for (int i = 0; i < 20; ++i) {  // enough work that a flag raised on the way is seen on the way
    const auto copy = scene.truth.observations;
    scene.truth.observations.insert(scene.truth.observations.end(), copy.begin(), copy.begin() + 960);
  }
  // When the flag goes up is a matter of luck: later and later, until one falls between two steps. By a tenth
  // more each time, so that a slow, instrumented build gets there soon, too.
  bool seen = false;
  for (double delay = 100.0; delay < 60e6 && !seen; delay *= 1.1) {
    BundleProblem problem = scene.disturbed();
    std::atomic<bool> abort = false;
    std::thread raiser([&] {
      std::this_thread::sleep_for(std::chrono::duration<double, std::micro>(delay));
      abort = true;
    });
    const BundleResult result = adjust(problem, {}, &abort);
    raiser.join();
    EXPECT_LE(result.final_cost, result.initial_cost);
    EXPECT_TRUE(std::isfinite(pose_error(problem, scene.truth)));
    seen = result.aborted && result.iterations > 0;
    if (seen && result.final_cost < result.initial_cost) {  // the steps taken are kept
      EXPECT_FALSE(same_poses(problem, scene.disturbed()));
    }
  }
  EXPECT_TRUE(seen);
}

TEST(BundleAdjustment, gives_the_same_bytes_twice_and_on_two_threads_at_once) {
  const Scene scene;
  BundleProblem alone = scene.disturbed(), first = alone, second = alone;
  adjust(alone);
  std::thread other([&] { adjust(first); });
  adjust(second);
  other.join();
  for (const BundleProblem* problem : {&first, &second}) {
    EXPECT_TRUE(same_poses(*problem, alone));
    EXPECT_EQ(point_error(*problem, alone), 0.0);
  }
}

TEST(BundleAdjustment, a_flag_that_is_never_raised_changes_nothing) {
  const Scene scene;
  BundleProblem polled = scene.disturbed(), plain = scene.disturbed();
  const std::atomic<bool> abort = false;
  EXPECT_FALSE(adjust(polled, {}, &abort).aborted);
  adjust(plain);
  EXPECT_EQ(point_error(polled, plain), 0.0);
}

TEST(BundleAdjustment, empty_problems_and_problems_without_a_usable_observation_come_back_as_they_were) {
  BundleProblem empty;
  EXPECT_TRUE(adjust(empty).outlier.empty());
  Scene scene;
  for (auto& o : scene.truth.observations) o.weight = 0.0;
  BundleProblem problem = scene.disturbed();
  const BundleResult result = adjust(problem);
  EXPECT_EQ(result.outlier, std::vector<std::uint8_t>(problem.observations.size(), 1));
  EXPECT_EQ(point_error(problem, scene.disturbed()), 0.0);
}

TEST(BundleAdjustment, an_index_that_points_nowhere_is_refused) {
  BundleProblem problem = Scene().truth;
  problem.observations[3].point = 120;
  EXPECT_THROW(adjust(problem), std::out_of_range);
}

}  // namespace
}  // namespace ipl_slam
