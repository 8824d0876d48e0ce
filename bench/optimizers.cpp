// The two optimisers that run all the time: the camera's pose from matches (once per frame) and local bundle
// adjustment (once per keyframe).

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include <benchmark/benchmark.h>

#include "geometry/camera.hpp"
#include "mapping/bundle_adjustment.hpp"
#include "tracking/pose_optimizer.hpp"

namespace ipl_slam {
namespace {

const Camera kCamera{};
const DepthNoiseOptions kNoise{};

class Random {
 public:
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1.0p-53;
  }
  // Sum of twelve uniform numbers: normal enough for a benchmark.
  double normal(double sigma) {
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) sum += uniform(0.0, 1.0);
    return sigma * sum;
  }
  Vector6d twist(double metres, double radians) {
    Vector6d xi;
    for (int i = 0; i < 6; ++i) xi[i] = uniform(-1.0, 1.0) * (i < 3 ? metres : radians);
    return xi;
  }
  Eigen::Vector3d noise(double sigma) { return {normal(sigma), normal(sigma), normal(sigma)}; }

 private:
  std::mt19937_64 engine_{1};
};

double noisy_depth(double z, Random& random) {
  return 1.0 / (1.0 / z + random.normal(kNoise.inverse_depth_sigma));
}

Eigen::Vector3d point_in_view(Random& random) {
  return kCamera.unproject({random.uniform(0, kCamera.width), random.uniform(0, kCamera.height)},
                           random.uniform(0.8, 5.0));
}

// 20 % outliers, 80 % of the points with depth: what a frame in a room looks like.
std::vector<PointMatch> point_matches(const SE3& T_cw, std::int64_t count, Random& random) {
  std::vector<PointMatch> matches(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const Eigen::Vector3d p_c = point_in_view(random);
    PointMatch& m = matches[i];
    m.point_w = T_cw.inverse() * p_c;
    m.sigma2 = std::pow(1.44, static_cast<double>(i % 8));
    const double sigma = i % 5 == 0 ? 30.0 : std::sqrt(m.sigma2);
    m.uv = kCamera.project(p_c) + Eigen::Vector2d(random.normal(sigma), random.normal(sigma));
    if (random.uniform(0.0, 1.0) < 0.8) m.depth = noisy_depth(p_c.z(), random);
  }
  return matches;
}

// 10 % outliers.
std::vector<LineMatch> line_matches(const SE3& T_cw, std::int64_t count, Random& random) {
  std::vector<LineMatch> matches;
  while (static_cast<std::int64_t>(matches.size()) < count) {
    const Eigen::Vector3d a = point_in_view(random), b = point_in_view(random);
    const SE3 T_wc = T_cw.inverse();
    const auto line = Line3::through(T_wc * a, T_wc * b);
    if (!line) continue;
    const double sigma = matches.size() % 10 == 0 ? 10.0 : 0.5;
    LineMatch m{.line_w = *line, .start = kCamera.project(a), .end = kCamera.project(b), .sigma2 = 0.25};
    for (Eigen::Vector2d* uv : {&m.start, &m.end}) {
      const double du = random.normal(sigma), dv = random.normal(sigma);
      *uv += Eigen::Vector2d(du, dv);
    }
    matches.push_back(m);
  }
  return matches;
}

void pose_optimizer(benchmark::State& state) {
  Random random;
  const SE3 T_cw = SE3::exp(random.twist(1.0, 0.5));
  const std::vector<PointMatch> points = point_matches(T_cw, state.range(0), random);
  const SE3 start = SE3::exp(random.twist(0.02, 0.02)) * T_cw;
  const std::vector<LineMatch> lines = line_matches(T_cw, state.range(1), random);
  const PoseOptimizer optimizer(kCamera, kNoise, {});
  for (auto _ : state) benchmark::DoNotOptimize(optimizer.optimize(start, points, lines));
}
BENCHMARK(pose_optimizer)
    ->ArgNames({"points", "lines"})
    ->Args({100, 0})
    ->Args({500, 0})
    ->Args({1000, 0})
    ->Args({500, 60})
    ->Args({0, 60})
    ->Unit(benchmark::kMicrosecond);

// Half of them fixed.
std::vector<BundleProblem::Pose> row_of_cameras(int count) {
  std::vector<BundleProblem::Pose> poses;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d c(0.08 * i, 0.02 * std::sin(i), 0.0);
    poses.push_back({SE3(Eigen::Quaterniond::Identity(), -c), i < count / 2});
  }
  return poses;
}

// Every point is seen from a stretch of the row, 5 % of the observations are wrong.
BundleProblem local_bundle(int poses, int points) {
  Random random;
  BundleProblem problem;
  problem.poses = row_of_cameras(poses);
  for (int p = 0; p < points; ++p) {
    const int seen_from = static_cast<int>(random.uniform(0, poses));
    const Eigen::Vector3d p_w =
        problem.poses[static_cast<std::size_t>(seen_from)].T_cw.inverse() * point_in_view(random);
    for (int i = std::max(0, seen_from - 3); i < std::min(poses, seen_from + 4); ++i) {
      const Eigen::Vector3d p_c = problem.poses[static_cast<std::size_t>(i)].T_cw * p_w;
      const Eigen::Vector2d uv = kCamera.project(p_c);
      if (uv.x() < 0 || uv.y() < 0 || uv.x() > kCamera.width || uv.y() > kCamera.height) continue;
      const double sigma = random.uniform(0.0, 1.0) < 0.05 ? 30.0 : 1.0;
      BundleProblem::Observation o;
      o.pose = static_cast<std::uint32_t>(i), o.point = static_cast<std::uint32_t>(p);
      o.uv = uv + Eigen::Vector2d(random.normal(sigma), random.normal(sigma));
      if (random.uniform(0.0, 1.0) < 0.8) o.depth = noisy_depth(p_c.z(), random);
      problem.observations.push_back(o);
    }
    problem.points.push_back(p_w + random.noise(0.03));
  }
  for (auto& pose : problem.poses)
    if (!pose.fixed) pose.T_cw = SE3::exp(random.twist(0.02, 0.01)) * pose.T_cw;
  return problem;
}

// A line some 0.3 to 1 m long, seen from eight poses in a row; 80 % of the observations have depth, 5 % are
// wrong.
void add_line(BundleProblem& problem, const std::vector<SE3>& T_cw, Random& random) {
  constexpr std::size_t kSeenFrom = 8;
  constexpr double kShortestSegment = 25.0;  // pixels; what the detector keeps
  const auto first =
      static_cast<std::size_t>(random.uniform(0, static_cast<double>(T_cw.size() - kSeenFrom)));
  const Eigen::Vector3d a = T_cw[first + kSeenFrom / 2].inverse() * point_in_view(random);
  const Eigen::Vector3d b = a + random.uniform(0.3, 1.0) * random.noise(1.0).normalized();
  for (std::size_t i = first; i < first + kSeenFrom; ++i) {
    const Eigen::Vector3d a_c = T_cw[i] * a, b_c = T_cw[i] * b;
    if (a_c.z() < 0.3 || b_c.z() < 0.3) continue;
    if ((kCamera.project(a_c) - kCamera.project(b_c)).norm() < kShortestSegment) continue;
    const double sigma = random.uniform(0.0, 1.0) < 0.05 ? 10.0 : 1.0;
    const bool depth = random.uniform(0.0, 1.0) < 0.8;
    BundleProblem::LineObservation o;
    o.pose = static_cast<std::uint32_t>(i), o.line = static_cast<std::uint32_t>(problem.lines.size());
    o.start = kCamera.project(a_c) + Eigen::Vector2d(random.normal(sigma), random.normal(sigma));
    o.end = kCamera.project(b_c) + Eigen::Vector2d(random.normal(sigma), random.normal(sigma));
    if (depth) o.inverse_start = 1.0 / noisy_depth(a_c.z(), random);
    if (depth) o.inverse_end = 1.0 / noisy_depth(b_c.z(), random);
    problem.line_observations.push_back(o);
  }
  problem.lines.push_back(*Line3::through(a + random.noise(0.03), b + random.noise(0.03)));
}

void add_lines(BundleProblem& problem, int poses, int lines) {
  Random random;
  std::vector<SE3> T_cw;
  for (const auto& pose : row_of_cameras(poses)) T_cw.push_back(pose.T_cw);
  for (int i = 0; i < lines; ++i) add_line(problem, T_cw, random);
}

void local_bundle_adjustment(benchmark::State& state) {
  const int poses = static_cast<int>(state.range(0)), lines = static_cast<int>(state.range(2));
  BundleProblem start = local_bundle(poses, static_cast<int>(state.range(1)));
  add_lines(start, poses, lines);
  BundleResult result;
  for (auto _ : state) {
    BundleProblem problem = start;
    result = adjust_bundle(problem, kCamera, kNoise, {});
  }
  state.counters["observations"] = static_cast<double>(start.observations.size());
  state.counters["line_observations"] = static_cast<double>(start.line_observations.size());
  state.counters["iterations"] = result.iterations;
}
BENCHMARK(local_bundle_adjustment)
    ->ArgNames({"poses", "points", "lines"})
    ->Args({8, 300, 0})
    ->Args({20, 1500, 0})
    ->Args({20, 1500, 150})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace ipl_slam
