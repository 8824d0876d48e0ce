// Carrying masks: three people who cover a third of a 640x480 image, one core. The figures are ellipses in a
// generated texture that move by a few pixels; a frame's view is made once, whatever the number of masks.
#include <benchmark/benchmark.h>
#include <opencv2/imgproc.hpp>

#include "common/random.hpp"
#include "segmentation/instance_tracker.hpp"

namespace {

using namespace ipl_slam;

constexpr int kPeople = 3;

cv::Mat texture(std::uint64_t seed) {
  Random random(seed);
  cv::Mat picture(480, 640, CV_8UC3, cv::Scalar(120, 120, 120));
  for (int i = 0; i < 5000; ++i) {
    const cv::Point at(static_cast<int>(random.index(640)), static_cast<int>(random.index(480)));
    cv::rectangle(picture, at, at + cv::Point(8, 8), cv::Scalar::all(random.uniform(40.0, 220.0)),
                  cv::FILLED);
  }
  return picture;
}

// Person i of 180 x 410 pixels in the image of frame `index`, as a picture of 0 and 255.
cv::Mat outline(int i, int index) {
  cv::Mat picture = cv::Mat::zeros(480, 640, CV_8UC1);
  cv::ellipse(picture, {105 + 215 * i + 6 * index, 240 + 2 * index}, {90, 205}, 0, 0, 360, 255, cv::FILLED);
  return picture;
}

struct Scene {
  RgbdFrame frame;
  std::vector<Instance> people;
};

Scene scene(int index) {
  static const cv::Mat wall = texture(1), clothes = texture(2);
  Scene s;
  s.frame.index = static_cast<std::size_t>(index);
  s.frame.color = wall.clone();
  s.frame.depth = cv::Mat(480, 640, CV_16UC1, cv::Scalar(20000));
  cv::Mat moved;
  cv::warpAffine(clothes, moved, cv::Matx23d(1, 0, 6 * index, 0, 1, 2 * index), wall.size(),
                 cv::INTER_NEAREST, cv::BORDER_WRAP);
  for (int i = 0; i < kPeople; ++i) {
    const cv::Mat shape = outline(i, index);
    moved.copyTo(s.frame.color, shape);
    s.frame.depth.setTo(10000, shape);
    const BitMask mask = BitMask::from_image(shape);
    s.people.push_back({"person", 0.9F, mask.bounding_box(), mask});
  }
  return s;
}

void make_view(benchmark::State& state) {
  cv::setNumThreads(1);
  const MaskCarrier carrier(Camera{});
  const Scene s = scene(0);
  for (auto _ : state) benchmark::DoNotOptimize(carrier.view(s.frame));
}

void carry_three_people(benchmark::State& state) {
  cv::setNumThreads(1);
  const MaskCarrier carrier(Camera{});
  const Scene before = scene(0), now = scene(static_cast<int>(state.range(0)));
  const CarryView from = carrier.view(before.frame), to = carrier.view(now.frame);
  std::vector<const BitMask*> masks;
  for (const Instance& person : before.people) masks.push_back(&person.mask);
  double overlap = 0.0;
  for (auto _ : state) {
    const std::vector<CarriedMask> carried = carrier.carry(from, masks, to);
    overlap = iou(carried[1].mask, now.people[1].mask);
  }
  state.counters["IoU"] = overlap;
}

void track_three_people(benchmark::State& state) {
  cv::setNumThreads(1);
  const Scene before = scene(0), now = scene(1);
  InstanceTracker tracker{Camera{}};
  tracker.update(tracker.view(before.frame), before.people);
  const CarryView view = tracker.view(now.frame);
  for (auto _ : state) {
    InstanceTracker copy = tracker;
    benchmark::DoNotOptimize(copy.update(view, now.people));
  }
}

BENCHMARK(make_view)->Unit(benchmark::kMillisecond);
BENCHMARK(carry_three_people)->Arg(1)->Arg(5)->Unit(benchmark::kMillisecond);
BENCHMARK(track_three_people)->Unit(benchmark::kMillisecond);

}  // namespace
