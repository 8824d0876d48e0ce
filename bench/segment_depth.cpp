// Depth along line segments: 200 segments of 60 pixels, a slanted plane with a depth camera's noise and one
// pixel in five without depth, with and without lens distortion.
#include "features/segment_depth.hpp"

#include <cmath>
#include <numbers>
#include <vector>

#include <benchmark/benchmark.h>

#include "common/random.hpp"

namespace {

using namespace ipl_slam;

cv::Mat noisy_plane(const Camera& camera, Random& random) {
  cv::Mat depth(camera.height, camera.width, CV_16UC1, cv::Scalar(0));
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      const double inverse = 0.5 + 4e-4 * (x - 320) + 2e-4 * (y - 240) + random.normal(0.0, 0.002);
      if (random.chance(0.8))
        depth.at<std::uint16_t>(y, x) = cv::saturate_cast<std::uint16_t>(5000 / inverse);
    }
  }
  return depth;
}

std::vector<LineSegment> segments(const Camera& camera, Random& random) {
  std::vector<LineSegment> result(200);
  for (LineSegment& segment : result) {
    const Eigen::Vector2d start(random.uniform(70, 570), random.uniform(70, 410));
    const double angle = random.uniform(0.0, 2.0 * std::numbers::pi);
    const Eigen::Vector2d end = start + 60.0 * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    segment.start = start.cast<float>(), segment.end = end.cast<float>();
    segment.start_pixel = camera.distort(start).cast<float>();
    segment.end_pixel = camera.distort(end).cast<float>();
  }
  return result;
}

void depth_of_200_segments(benchmark::State& state, bool distorted) {
  Camera camera;
  if (distorted) camera.k1 = 0.262383, camera.k2 = -0.953104, camera.k3 = 1.163314;
  Random random(1);
  const cv::Mat depth = noisy_plane(camera, random);
  const std::vector<LineSegment> lines = segments(camera, random);
  for (auto _ : state) {
    for (const LineSegment& line : lines) {
      benchmark::DoNotOptimize(segment_depth(depth, line, camera, {}, {}));
    }
  }
}

BENCHMARK_CAPTURE(depth_of_200_segments, pinhole, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(depth_of_200_segments, distorted, true)->Unit(benchmark::kMillisecond);

}  // namespace
