// Packed masks against the plain OpenCV calls on the same masks, and the contour window per frame. The masks
// are an outline as large as a person two metres away in an image of 640 x 480.
#include <benchmark/benchmark.h>
#include <opencv2/imgproc.hpp>

#include "dynamics/contour_window.hpp"
#include "dynamics/shape_similarity.hpp"
#include "segmentation/mask_moments.hpp"

namespace {

using namespace ipl_slam;

// A head and a body with outstretched arms, shifted by whole pixels.
cv::Mat person_image(int x, int y) {
  cv::Mat image = cv::Mat::zeros(480, 640, CV_8UC1);
  cv::ellipse(image, {x, y - 130}, {28, 36}, 0.0, 0.0, 360.0, cv::Scalar(255), cv::FILLED);
  cv::ellipse(image, {x, y}, {60, 110}, 0.0, 0.0, 360.0, cv::Scalar(255), cv::FILLED);
  cv::ellipse(image, {x, y - 40}, {130, 18}, 10.0, 0.0, 360.0, cv::Scalar(255), cv::FILLED);
  cv::ellipse(image, {x - 25, y + 140}, {24, 90}, 5.0, 0.0, 360.0, cv::Scalar(255), cv::FILLED);
  return image;
}

struct Masks {
  cv::Mat image_a = person_image(300, 230), image_b = person_image(318, 226);
  BitMask a = BitMask::from_image(image_a), b = BitMask::from_image(image_b);
};

const Masks& masks() {
  static const Masks made;
  return made;
}

Simd body(const benchmark::State& state) {
  return state.range(0) == 0 ? Simd::portable : best_simd();
}

void pack(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(BitMask::from_image(masks().image_a, body(state)));
}
BENCHMARK(pack)->Arg(0)->Arg(1);

void unpack(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(masks().a.to_image(body(state)));
}
BENCHMARK(unpack)->Arg(0)->Arg(1);

void area(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(masks().a.area(body(state)));
}
BENCHMARK(area)->Arg(0)->Arg(1);

void area_opencv(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(cv::countNonZero(masks().image_a));
}
BENCHMARK(area_opencv);

void overlap(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(iou(masks().a, masks().b, body(state)));
}
BENCHMARK(overlap)->Arg(0)->Arg(1);

void overlap_opencv(benchmark::State& state) {
  cv::Mat both, either;
  for (auto _ : state) {
    cv::bitwise_and(masks().image_a, masks().image_b, both);
    cv::bitwise_or(masks().image_a, masks().image_b, either);
    benchmark::DoNotOptimize(static_cast<double>(cv::countNonZero(both)) / cv::countNonZero(either));
  }
}
BENCHMARK(overlap_opencv);

void bounding_box(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(masks().a.bounding_box());
}
BENCHMARK(bounding_box);

void bounding_box_opencv(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(cv::boundingRect(masks().image_a));
}
BENCHMARK(bounding_box_opencv);

void hu(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(hu_invariants(mask_moments(masks().a)));
}
BENCHMARK(hu);

void hu_opencv(benchmark::State& state) {
  double invariants[7];
  for (auto _ : state) {
    cv::HuMoments(cv::moments(masks().image_a, true), invariants);
    benchmark::DoNotOptimize(invariants);
  }
}
BENCHMARK(hu_opencv);

void shape(benchmark::State& state) {
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        hu_similarity(hu_invariants(mask_moments(masks().a)), hu_invariants(mask_moments(masks().b))));
  }
}
BENCHMARK(shape);

void shape_opencv(benchmark::State& state) {
  for (auto _ : state) {
    std::vector<std::vector<cv::Point>> a, b;
    cv::findContours(masks().image_a, a, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
    cv::findContours(masks().image_b, b, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
    benchmark::DoNotOptimize(cv::matchShapes(a[0], b[0], cv::CONTOURS_MATCH_I2, 0.0));
  }
}
BENCHMARK(shape_opencv);

void dilate_by_10(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(dilated(masks().a, 10));
}
BENCHMARK(dilate_by_10);

void dilate_by_10_opencv(benchmark::State& state) {
  const cv::Mat disc = cv::getStructuringElement(cv::MORPH_ELLIPSE, {21, 21});
  cv::Mat grown;
  for (auto _ : state) cv::dilate(masks().image_a, grown, disc);
}
BENCHMARK(dilate_by_10_opencv);

// One frame with five instances that are all judged in full: record table off.
void contour_window(benchmark::State& state) {
  Camera camera;
  camera.k1 = state.range(0) != 0 ? 0.26 : 0.0;
  ContourWindowOptions options;
  options.record_table = false;
  ContourWindow window(camera, options);
  ContourFrame frame;
  frame.depth = cv::Mat(480, 640, CV_16UC1, cv::Scalar(10000));
  frame.T_wc = SE3();
  for (std::uint32_t i = 0; i < 5; ++i) {
    TrackedInstance tracked;
    tracked.id = InstanceId{i};
    tracked.instance.class_name = "person";
    tracked.instance.mask = BitMask::from_image(person_image(140 + 90 * static_cast<int>(i), 230));
    frame.instances.push_back(tracked);
  }
  for (; frame.index < 25; ++frame.index) static_cast<void>(window.process(frame));
  for (auto _ : state) {
    benchmark::DoNotOptimize(window.process(frame));
    ++frame.index;
  }
}
BENCHMARK(contour_window)->ArgName("distorted")->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);

}  // namespace
