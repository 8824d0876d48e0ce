// The search for known lines that every tracked frame pays for: the 60 longest lines of a frame of the
// synthetic room, looked for in that same frame up to three pixels beside where they are.

#include "tracking/line_search.hpp"

#include <vector>

#include <benchmark/benchmark.h>
#include <opencv2/imgproc.hpp>

#include "common/random.hpp"
#include "dataset/synthetic/synthetic_source.hpp"
#include "features/line_detector.hpp"

namespace ipl_slam {
namespace {

constexpr std::size_t kLines = 60;

struct Scene {
  Camera camera;
  cv::Mat grey = {};
  std::vector<ExpectedLine> expected = {};
};

Scene make_scene() {
  SyntheticOptions options;
  options.frames = 2;
  const SyntheticSource source(options);
  Scene scene{.camera = source.camera()};
  cv::cvtColor(source.render(0).rgbd.color, scene.grey, cv::COLOR_BGR2GRAY);
  Random random(1);
  const auto shift = [&] {
    const double du = random.uniform(-2.0, 2.0), dv = random.uniform(-2.0, 2.0);
    return Eigen::Vector2d(du, dv);
  };
  for (const LineSegment& s : LineDetector(LineMethod::kEdges, {}, scene.camera).detect(scene.grey)) {
    if (scene.expected.size() == kLines) break;
    const Eigen::Vector2d start = s.start.cast<double>() + shift(), end = s.end.cast<double>() + shift();
    scene.expected.push_back({start, end, s.contrast});
  }
  return scene;
}

// Argument 0: search radius in pixels; argument 1: whether the lens bends the image (then the same picture
// stands for a distorted one, which costs the same).
void line_search(benchmark::State& state) {
  static const Scene scene = make_scene();
  Camera camera = scene.camera;
  if (state.range(1) != 0) camera.k1 = 0.01;
  const LineSearch search(camera, {});
  int found = 0;
  for (auto _ : state) {
    found = 0;
    for (const ExpectedLine& expected : scene.expected) {
      found += search.find(scene.grey, expected, static_cast<double>(state.range(0))) ? 1 : 0;
    }
  }
  state.counters["lines"] = static_cast<double>(scene.expected.size());
  state.counters["found"] = found;
}
BENCHMARK(line_search)
    ->ArgNames({"radius", "distorted"})
    ->Args({5, 0})
    ->Args({5, 1})
    ->Args({15, 0})
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace ipl_slam
