// Saving and loading a map of 1000 keyframes with 1000 keypoints and 100 line segments each, every other
// keypoint seen by three keyframes. The file lies in the folder for temporary files.
#include "map/map_file.hpp"

#include <filesystem>
#include <memory>

#include <benchmark/benchmark.h>
#include <unistd.h>

#include "common/random.hpp"
#include "map/map_bytes.hpp"

namespace {

using namespace ipl_slam;

constexpr int kKeyframes = 1000, kKeypoints = 1000, kSegments = 100;

std::shared_ptr<const Frame> any_frame(std::size_t index, Random& random) {
  Features features;
  for (int i = 0; i < kKeypoints; ++i) {
    Keypoint keypoint;
    keypoint.pixel = keypoint.undistorted =
        Eigen::Vector2d(random.uniform(0.0, 639.0), random.uniform(0.0, 479.0)).cast<float>();
    keypoint.level = static_cast<int>(random.index(8));
    features.keypoints.push_back(keypoint);
    features.descriptors.push_back({random.bits(), random.bits(), random.bits(), random.bits()});
  }
  FeatureGrid grid(features);
  return std::make_shared<const Frame>(
      Frame{index, static_cast<double>(index), std::move(features), std::move(grid)});
}

Map large_map() {
  Map map(ScalePyramid(8, 1.2));
  Random random(1);
  LineFeatures lines;
  lines.segments.resize(kSegments);
  lines.descriptors.resize(kSegments);
  const auto segments = std::make_shared<const LineFeatures>(std::move(lines));
  for (std::uint32_t k = 0; k < kKeyframes; ++k) {
    const SE3 T_cw(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-0.1 * k, 0.0, 0.0));
    const KeyframeId id = map.add_keyframe(any_frame(k, random), T_cw, segments);
    if (k % 3 != 2) continue;
    for (std::uint32_t i = 0; i < kKeypoints; i += 2) {
      const PointId point = map.add_point({0.1 * k, random.uniform(-1.0, 1.0), 3.0}, id, i);
      map.add_observation(point, KeyframeId{k - 1}, i);
      map.add_observation(point, KeyframeId{k - 2}, i);
      map.refresh(point);
    }
  }
  return map;
}

const Map& the_map() {
  static const Map map = large_map();
  return map;
}

struct TemporaryFile {
  ~TemporaryFile() { std::filesystem::remove(path); }
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("ipl_slam_bench_" + std::to_string(::getpid()) + ".map");
};

void save(benchmark::State& state) {
  const Map& map = the_map();
  const TemporaryFile file;
  for (auto _ : state) save_map(file.path, map, Camera{});
  state.counters["MB"] = static_cast<double>(std::filesystem::file_size(file.path)) / 1e6;
}

void load(benchmark::State& state) {
  const TemporaryFile file;
  save_map(file.path, the_map(), Camera{});
  for (auto _ : state) benchmark::DoNotOptimize(load_map(file.path));
}

void encode(benchmark::State& state) {
  const Map& map = the_map();
  for (auto _ : state) benchmark::DoNotOptimize(encode_map(map, Camera{}));
}

BENCHMARK(save)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(load)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(encode)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
