// Lines of keyframes: descriptors, the gates and both matchers, each with and without AVX2 and against a
// plain loop that looks at one segment after the other as it is stored.
#include <cmath>

#include <benchmark/benchmark.h>
#include <opencv2/imgproc.hpp>

#include "common/random.hpp"
#include "features/line_descriptor.hpp"
#include "features/line_matcher.hpp"
#include "features/segment_gate.hpp"

namespace {

using namespace ipl_slam;

constexpr std::size_t kSegments = 200;

LineSegment random_segment(Random& random) {
  // Mean length 60 pixels.
  const double angle = random.uniform(-3.1, 3.1), length = random.uniform(25.0, 95.0);
  LineSegment s;
  s.start = {static_cast<float>(random.uniform(0.0, 640.0)), static_cast<float>(random.uniform(0.0, 480.0))};
  s.end = s.start + Eigen::Vector2f(static_cast<float>(length * std::cos(angle)),
                                    static_cast<float>(length * std::sin(angle)));
  s.start_pixel = s.start, s.end_pixel = s.end;
  return s;
}

LineFeatures random_lines() {
  Random random(1);
  LineFeatures lines;
  for (std::size_t i = 0; i < kSegments; ++i) {
    lines.segments.push_back(random_segment(random));
    lines.descriptors.push_back({random.bits(), random.bits(), random.bits(), random.bits()});
  }
  return lines;
}

LineFeatures shifted(LineFeatures lines) {
  for (LineSegment& s : lines.segments) s.start.x() += 20.0F, s.end.x() += 20.0F;
  for (Descriptor& d : lines.descriptors) d[0] ^= 0xfffffULL;
  return lines;
}

void describe(benchmark::State& state) {
  Random random(2);
  cv::Mat image(480, 640, CV_8UC1);
  for (int i = 0; i < 640 * 480; ++i) image.data[i] = static_cast<std::uint8_t>(random.bits());
  cv::GaussianBlur(image, image, {7, 7}, 2.0);
  LineFeatures lines = random_lines();
  for (std::size_t i = 0; i < lines.size(); ++i) lines.segments[i].octave = i % 4 == 0 ? 1 : 0;
  for (auto _ : state) benchmark::DoNotOptimize(describe_segments(image, lines.segments, {}));
}
BENCHMARK(describe)->Unit(benchmark::kMillisecond);

const SegmentGate kGate{.radius = 25.0F, .min_cosine = 0.98F, .min_overlap = 0.3F, .along = 25.0F};

void gates(benchmark::State& state, Simd simd) {
  const LineFeatures lines = random_lines();
  std::vector<int> found;
  for (auto _ : state) {
    const SegmentTable table(lines.segments);
    for (const LineSegment& s : lines.segments) {
      found.clear();
      table.find(s.start, s.end, kGate, simd, found);
      benchmark::DoNotOptimize(found.data());
    }
  }
}
BENCHMARK_CAPTURE(gates, avx2, best_simd())->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(gates, portable, Simd::portable)->Unit(benchmark::kMicrosecond);

// The loop one would write first: gate after gate, leaving at the first that fails.
bool passes(const LineSegment& expected, const LineSegment& s) {
  const float length = expected.length(), own = s.length();
  const Eigen::Vector2f d = (expected.end - expected.start) / length;
  if (d.dot(s.end - s.start) / own < kGate.min_cosine) return false;
  const Eigen::Vector2f across(-d.y(), d.x());
  if (std::fabs(across.dot(s.start - expected.start)) > kGate.radius) return false;
  if (std::fabs(across.dot(s.end - expected.start)) > kGate.radius) return false;
  const float overlap = std::min(d.dot(s.end - expected.start), length) -
                        std::max(d.dot(s.start - expected.start), 0.0F) + kGate.along;
  return overlap >= kGate.min_overlap * std::min(length, own) &&
         std::max(length, own) <= kGate.max_length_ratio * std::min(length, own);
}

void gates_plain_loop(benchmark::State& state) {
  const LineFeatures lines = random_lines();
  std::vector<int> found;
  for (auto _ : state) {
    for (const LineSegment& expected : lines.segments) {
      found.clear();
      for (std::size_t i = 0; i < lines.size(); ++i) {
        if (passes(expected, lines.segments[i])) found.push_back(static_cast<int>(i));
      }
      benchmark::DoNotOptimize(found.data());
    }
  }
}
BENCHMARK(gates_plain_loop)->Unit(benchmark::kMicrosecond);

void match_lines(benchmark::State& state, Simd simd) {
  const LineFeatures a = random_lines(), b = shifted(a);
  for (auto _ : state) benchmark::DoNotOptimize(ipl_slam::match_lines(a, b, {}, simd));
}
BENCHMARK_CAPTURE(match_lines, avx2, best_simd())->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(match_lines, portable, Simd::portable)->Unit(benchmark::kMicrosecond);

void match_projected(benchmark::State& state, Simd simd) {
  const LineFeatures lines = random_lines();
  std::vector<ProjectedSegment> projected;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const LineSegment& s = lines.segments[i];
    projected.push_back({s.start, s.end, &lines.descriptors[i], 10.0F});
  }
  for (auto _ : state) benchmark::DoNotOptimize(match_projected_lines(lines, projected, {}, simd));
}
BENCHMARK_CAPTURE(match_projected, avx2, best_simd())->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(match_projected, portable, Simd::portable)->Unit(benchmark::kMicrosecond);

}  // namespace
