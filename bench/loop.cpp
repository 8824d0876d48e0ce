// Loop closing at the size of a long run: a thousand keyframes in the pose graph and the essential graph,
// some hundred in global bundle adjustment.

#include <cmath>
#include <numbers>

#include <benchmark/benchmark.h>

#include "common/random.hpp"
#include "loop/essential_graph.hpp"
#include "loop/global_bundle.hpp"
#include "loop/pose_graph.hpp"

namespace ipl_slam {
namespace {

const Camera kCamera{.fx = 525.0, .fy = 525.0, .cx = 319.5, .cy = 239.5};
const ScalePyramid kPyramid{8, 1.2};

Vector6d random_twist(Random& random, double size) {
  Vector6d twist;
  for (int k = 0; k < 6; ++k) twist[k] = size * random.normal();
  return twist;
}

// T_cw of the i-th of n cameras that go round a circle 3 m from a wall of points, looking at it.
SE3 pose(std::size_t i, double radius, std::size_t n) {
  const double angle = 2.0 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(n);
  const Eigen::Quaterniond q(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()));
  return SE3(q, radius * Eigen::Vector3d(std::sin(angle), 0.0, std::cos(angle))).inverse();
}

// A map of n keyframes 15 cm apart on a circle, each with about a thousand observations, disturbed.
Map make_map(std::size_t n) {
  Random random(1);
  const double radius = 0.15 * static_cast<double>(n) / (2.0 * std::numbers::pi);
  const double view = 640.0 / 525.0 * 3.0;  // metres of wall in an image
  const auto count = static_cast<std::size_t>(2000.0 * static_cast<double>(n) * 0.15 / view);
  std::vector<std::vector<std::pair<std::size_t, Keypoint>>> seen(n);
  std::vector<Eigen::Vector3d> points;
  for (std::size_t p = 0; p < count; ++p) {
    const double angle = random.uniform(0.0, 2.0 * std::numbers::pi), r = radius + random.uniform(2.5, 3.5);
    points.emplace_back(r * std::sin(angle), random.uniform(-1.2, 1.2), r * std::cos(angle));
    const auto middle =
        static_cast<std::ptrdiff_t>(angle / (2.0 * std::numbers::pi) * static_cast<double>(n));
    for (std::ptrdiff_t d = -20; d <= 20; ++d) {
      const auto i = static_cast<std::size_t>((middle + d + static_cast<std::ptrdiff_t>(n)) %
                                              static_cast<std::ptrdiff_t>(n));
      const Eigen::Vector3d p_c = pose(i, radius, n) * points.back();
      if (p_c.z() < 0.5) continue;
      const Eigen::Vector2d uv =
          kCamera.project(p_c) + 0.5 * Eigen::Vector2d(random.normal(), random.normal());
      if (uv.x() < 0.0 || uv.y() < 0.0 || uv.x() > 639.0 || uv.y() > 479.0 || !random.chance(0.7)) continue;
      Keypoint keypoint;
      keypoint.pixel = keypoint.undistorted = uv.cast<float>();
      keypoint.depth = static_cast<float>(1.0 / (1.0 / p_c.z() + 0.003 * random.normal()));
      seen[i].emplace_back(p, keypoint);
    }
  }
  Map map(kPyramid);
  std::vector<PointId> ids(count);
  for (std::size_t i = 0; i < n; ++i) {
    Features features;
    for (const auto& [p, keypoint] : seen[i]) {
      features.keypoints.push_back(keypoint);
      features.descriptors.push_back({});
    }
    FeatureGrid grid(features);
    const auto frame = std::make_shared<const Frame>(Frame{i, 0.0, std::move(features), std::move(grid)});
    const SE3 T_cw = SE3::exp(random_twist(random, i > 0 ? 0.005 : 0.0)) * pose(i, radius, n);
    const KeyframeId id = map.add_keyframe(frame, T_cw);
    for (std::uint32_t k = 0; k < seen[i].size(); ++k) {
      PointId& point = ids[seen[i][k].first];
      if (point.valid()) {
        map.add_observation(point, id, k);
      } else {
        point = map.add_point(points[seen[i][k].first], id, k);
      }
    }
  }
  return map;
}

void pose_graph(benchmark::State& state) {
  const auto n = static_cast<std::size_t>(state.range(0));
  Random random(3);
  PoseGraph graph;
  for (std::size_t i = 0; i < n; ++i) graph.poses.push_back({pose(i, 10.0, n), i == 0 || i + 1 == n});
  for (std::uint32_t step = 1; step <= 5; ++step) {
    for (std::uint32_t i = 0; i + step < n; ++i) {
      const SE3 T_ab = graph.poses[i].T_cw * graph.poses[i + step].T_cw.inverse();
      graph.edges.push_back({i, i + step, SE3::exp(random_twist(random, 0.004)) * T_ab});
    }
  }
  graph.poses.back().T_cw = SE3::exp(random_twist(random, 0.1)) * graph.poses.back().T_cw;
  for (auto _ : state) {
    PoseGraph copy = graph;
    state.counters["iterations"] = optimize_pose_graph(copy, {}).iterations;
  }
}
BENCHMARK(pose_graph)->Arg(1000)->Unit(benchmark::kMillisecond);

void essential_graph_of_map(benchmark::State& state) {
  const Map map = make_map(static_cast<std::size_t>(state.range(0)));
  for (auto _ : state)
    state.counters["edges"] = static_cast<double>(essential_graph(map, PartId{0}, {}).size());
}
BENCHMARK(essential_graph_of_map)->Arg(1000)->Unit(benchmark::kMillisecond);

void global_bundle(benchmark::State& state) {
  const Map map = make_map(static_cast<std::size_t>(state.range(0)));
  for (auto _ : state) {
    Map copy = map;
    GlobalBundle bundle(copy, PartId{0}, kCamera, DepthNoiseOptions{}, LineNoise{}, BundleOptions{});
    bundle.solve();
    bundle.apply(copy);
  }
  double observations = 0.0;
  map.points().for_each(
      [&](PointId, const Point& p) { observations += static_cast<double>(p.observations.size()); });
  state.counters["observations"] = observations;
}
BENCHMARK(global_bundle)->Arg(100)->Arg(400)->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace ipl_slam
