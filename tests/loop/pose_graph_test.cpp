#include "loop/pose_graph.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "common/random.hpp"
#include "loop/relative_pose_cost.hpp"
#include "support/synthetic_world.hpp"

namespace ipl_slam {
namespace {

using namespace test;

Vector6d random_twist(Random& random, double size) {
  Vector6d twist;
  for (int k = 0; k < 6; ++k) twist[k] = size * random.normal();
  return twist;
}

// A camera that goes round a circle of 10 m and comes back; each step of its odometry is off by a little.
struct Ring {
  explicit Ring(std::size_t n, double noise = 0.004) {
    Random random(3);
    for (std::size_t i = 0; i < n; ++i) {
      const double angle = 2.0 * M_PI * static_cast<double>(i) / static_cast<double>(n);
      truth.push_back(camera_at({10.0 * std::sin(angle), 0.0, 10.0 * std::cos(angle)}, angle));
      if (i == 0) {
        graph.poses.push_back({truth[0], true});
        continue;
      }
      const SE3 step = SE3::exp(random_twist(random, noise)) * truth[i] * truth[i - 1].inverse();
      graph.poses.push_back({step * graph.poses[i - 1].T_cw, false});
      const auto b = static_cast<std::uint32_t>(i);
      graph.edges.push_back({b - 1, b, step.inverse()});
    }
  }
  void close() {
    const auto last = static_cast<std::uint32_t>(truth.size() - 1);
    graph.edges.push_back({last, 0, truth[last] * truth[0].inverse(), 100.0});
  }
  [[nodiscard]] double error() const {  // root mean square distance, m
    double sum = 0.0;
    for (std::size_t i = 0; i < truth.size(); ++i)
      sum += (truth[i].inverse().translation() - graph.poses[i].T_cw.inverse().translation()).squaredNorm();
    return std::sqrt(sum / static_cast<double>(truth.size()));
  }
  PoseGraph graph;
  std::vector<SE3> truth;
};

TEST(RelativePoseCost, ItsJacobiansAreThoseOfItsResidual) {
  Random random(1);
  for (const double size : {1e-4, 0.05, 0.8}) {
    const SE3 T_a = SE3::exp(random_twist(random, 0.7)), T_b = SE3::exp(random_twist(random, 0.7));
    const SE3 T_ab = SE3::exp(random_twist(random, size)) * T_a * T_b.inverse();
    const Vector6d scale{1.0, 2.0, 3.0, 4.0, 5.0, 6.0};
    const RelativePoseCost cost(T_ab, scale);
    const auto residual = [&](const SE3& a, const SE3& b) {
      double block_a[kPoseBlockSize], block_b[kPoseBlockSize];
      to_pose_block(a, block_a);
      to_pose_block(b, block_b);
      const double* blocks[] = {block_a, block_b};
      Vector6d e;
      EXPECT_TRUE(cost.Evaluate(blocks, e.data(), nullptr));
      return e;
    };
    double block_a[kPoseBlockSize], block_b[kPoseBlockSize];
    to_pose_block(T_a, block_a);
    to_pose_block(T_b, block_b);
    const double* blocks[] = {block_a, block_b};
    Eigen::Matrix<double, 6, kPoseBlockSize, Eigen::RowMajor> in_a, in_b, dx_a, dx_b;
    double* jacobians[] = {in_a.data(), in_b.data()};
    Vector6d e;
    ASSERT_TRUE(cost.Evaluate(blocks, e.data(), jacobians));
    Eigen::Matrix<double, kPoseBlockSize, 6, Eigen::RowMajor> plus_a, plus_b;
    SE3Manifold().PlusJacobian(block_a, plus_a.data());
    SE3Manifold().PlusJacobian(block_b, plus_b.data());
    const Matrix6d J_a = in_a * plus_a, J_b = in_b * plus_b;
    constexpr double kStep = 1e-5;  // central differences: errors of 1e-10 of truncation, 1e-11 of rounding
    for (int k = 0; k < 6; ++k) {
      const SE3 up = SE3::exp(kStep * Vector6d::Unit(k)), down = SE3::exp(-kStep * Vector6d::Unit(k));
      const Vector6d d_a = (residual(up * T_a, T_b) - residual(down * T_a, T_b)) / (2.0 * kStep);
      const Vector6d d_b = (residual(T_a, up * T_b) - residual(T_a, down * T_b)) / (2.0 * kStep);
      EXPECT_LT((J_a.col(k) - d_a).norm(), 1e-7) << "residual " << size << ", component " << k;
      EXPECT_LT((J_b.col(k) - d_b).norm(), 1e-7) << "residual " << size << ", component " << k;
    }
  }
}

TEST(PoseGraph, PosesThatAgreeWithTheirEdgesStay) {
  Ring ring(50);
  const PoseGraph before = ring.graph;
  const PoseGraphResult result = optimize_pose_graph(ring.graph, {});
  EXPECT_LT(result.initial_cost, 1e-20);
  for (std::size_t i = 0; i < 50; ++i)
    EXPECT_LT(pose_difference(ring.graph.poses[i].T_cw, before.poses[i].T_cw), 1e-9);
}

TEST(PoseGraph, ALoopTakesMostOfTheDriftOut) {
  Ring ring(1000);
  ring.close();
  const double before = ring.error();
  const PoseGraphResult result = optimize_pose_graph(ring.graph, {});
  // What is left is that of a random walk tied at both ends: a third or less of one tied at one end.
  EXPECT_GT(before, 0.3);
  EXPECT_LT(ring.error(), before / 3.0);
  EXPECT_LT(result.final_cost, 0.01 * result.initial_cost);
  EXPECT_LT(result.iterations, 20);
}

TEST(PoseGraph, ConsistentEdgesAreMetWhateverTheStart) {
  Ring ring(40, 0.0);
  ring.close();
  Random random(9);
  for (std::size_t i = 1; i < 40; ++i)
    ring.graph.poses[i].T_cw = SE3::exp(random_twist(random, 0.3)) * ring.truth[i];
  const PoseGraphResult result = optimize_pose_graph(ring.graph, {});
  EXPECT_LT(result.final_cost, 1e-9);
  for (std::size_t i = 0; i < 40; ++i)
    EXPECT_LT(pose_difference(ring.graph.poses[i].T_cw, ring.truth[i]), 1e-3);
}

TEST(PoseGraph, FixedPosesStayToTheByteAndAWeightDecidesBetweenTheirNeighbours) {
  // On a line between 0 and 1 m, a pose that one edge wants at 0.2 and the other, nine times as heavy, at
  // 0.3.
  PoseGraph graph;
  graph.poses = {{camera_at({0.0, 0.0, 0.0}), true},
                 {camera_at({0.5, 0.0, 0.0}), false},
                 {camera_at({1.0, 0.0, 0.0}), true}};
  graph.edges = {{0, 1, SE3(Eigen::Quaterniond::Identity(), {0.2, 0.0, 0.0}), 1.0},
                 {1, 2, SE3(Eigen::Quaterniond::Identity(), {0.7, 0.0, 0.0}), 9.0}};
  const PoseGraph before = graph;
  optimize_pose_graph(graph, {});
  EXPECT_NEAR(graph.poses[1].T_cw.inverse().translation().x(), 0.29, 1e-4)
      << "the last step gains a millionth of the cost";
  for (const std::size_t i : {0, 2}) {
    EXPECT_EQ(graph.poses[i].T_cw.translation(), before.poses[i].T_cw.translation());
    EXPECT_EQ(graph.poses[i].T_cw.rotation().coeffs(), before.poses[i].T_cw.rotation().coeffs());
  }
}

TEST(PoseGraph, SameInputSameBytes) {
  const auto solved = [] {
    Ring ring(200);
    ring.close();
    optimize_pose_graph(ring.graph, {});
    return ring.graph;
  };
  const PoseGraph a = solved(), b = solved();
  for (std::size_t i = 0; i < a.poses.size(); ++i) {
    EXPECT_EQ(a.poses[i].T_cw.translation(), b.poses[i].T_cw.translation());
    EXPECT_EQ(a.poses[i].T_cw.rotation().coeffs(), b.poses[i].T_cw.rotation().coeffs());
  }
}

TEST(PoseGraph, StopsWhereItIsTold) {
  Ring ring(200);
  ring.close();
  const PoseGraph before = ring.graph;
  const std::atomic<bool> abort = true;
  EXPECT_TRUE(optimize_pose_graph(ring.graph, {}, &abort).aborted);
  for (std::size_t i = 0; i < 200; ++i)
    EXPECT_EQ(ring.graph.poses[i].T_cw.translation(), before.poses[i].T_cw.translation());
}

TEST(PoseGraph, RefusesAnEdgeToAPoseThereIsNot) {
  Ring ring(3);
  ring.graph.edges.push_back({0, 3, SE3()});
  EXPECT_THROW(optimize_pose_graph(ring.graph, {}), std::out_of_range);
}

}  // namespace
}  // namespace ipl_slam
