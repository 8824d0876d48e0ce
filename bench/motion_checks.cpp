// Checks of what moves: the epipolar geometry of two frames from 500 pairs, and the lines of two keyframes
// with 150 segments each.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <benchmark/benchmark.h>

#include "common/random.hpp"
#include "dynamics/epipolar_check.hpp"
#include "dynamics/line_motion_check.hpp"

namespace {

using namespace ipl_slam;

constexpr std::size_t kPairs = 500;
constexpr int kSegments = 150;

const Camera kCamera;
const SE3 kMotion = SE3::exp((Vector6d() << 0.02, 0.0, 0.01, 0.01, 0.02, -0.01).finished());
const SE3 kTurn = SE3::exp((Vector6d() << 0.0, 0.0, 0.0, 0.01, 0.02, -0.01).finished());

// Points 1 to 4 m away, 0.3 pixels of noise; the first `wrong` percent are matched at random.
std::vector<PixelPair> pairs(const SE3& T_now_before, std::size_t wrong) {
  Random random(1);
  std::vector<PixelPair> result(kPairs);
  const auto noise = [&]() -> Eigen::Vector2d { return {random.normal(0.0, 0.3), random.normal(0.0, 0.3)}; };
  for (PixelPair& p : result) {
    const Eigen::Vector2d uv(random.uniform(20.0, 620.0), random.uniform(20.0, 460.0));
    p.before = uv + noise();
    p.now = kCamera.project(T_now_before * kCamera.unproject(uv, random.uniform(1.0, 4.0))) + noise();
  }
  for (std::size_t i = 0; i < kPairs * wrong / 100; ++i) {
    result[i].now = {random.uniform(0.0, 640.0), random.uniform(0.0, 480.0)};
  }
  return result;
}

void fundamental(benchmark::State& state, const SE3& T_now_before) {
  const std::vector<PixelPair> data = pairs(T_now_before, static_cast<std::size_t>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(fundamental_matrix(data, {}, 1));
}
BENCHMARK_CAPTURE(fundamental, wrong_percent, kMotion)
    ->Arg(0)
    ->Arg(20)
    ->Arg(40)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(fundamental, pure_rotation_wrong_percent, kTurn)
    ->Arg(0)
    ->Arg(20)
    ->Unit(benchmark::kMicrosecond);

LineSegment seen(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  LineSegment s;
  s.start = s.start_pixel = kCamera.project(a).cast<float>();
  s.end = s.end_pixel = kCamera.project(b).cast<float>();
  s.depth = {static_cast<float>(1.0 / a.z()), static_cast<float>(1.0 / b.z()),
             1e-6F * Eigen::Matrix2f::Identity()};
  return s;
}

// One line in ten moves by itself.
void lines(benchmark::State& state, const char* check) {
  Random random(1);
  LineFeatures before, now;
  for (int i = 0; i < kSegments; ++i) {
    const double angle = random.uniform(-std::numbers::pi, std::numbers::pi);
    const Eigen::Vector3d a(random.uniform(-1.0, 1.0), random.uniform(-0.7, 0.7), 2.0);
    const Eigen::Vector3d b = a + 0.3 * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
    const Eigen::Vector3d own(0.0, i % 10 == 0 ? 0.05 : 0.0, 0.0);
    before.segments.push_back(seen(a, b));
    now.segments.push_back(seen(kMotion * (a + own), kMotion * (b + own)));
    before.descriptors.push_back({random.bits(), random.bits(), random.bits(), random.bits()});
  }
  now.descriptors = before.descriptors;
  for (Descriptor& d : now.descriptors) d[0] ^= 0xfffffULL;
  LineMotionOptions options;
  options.check = check;
  const LineMotionCheck motion_check(kCamera, options);
  for (auto _ : state) benchmark::DoNotOptimize(motion_check.compare(before, now, kMotion));
}
BENCHMARK_CAPTURE(lines, angle, "angle")->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(lines, residual, "residual")->Unit(benchmark::kMicrosecond);

}  // namespace
