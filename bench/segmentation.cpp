// The YOLO segmenter without its network: filling the input, finding candidates, suppression, masks. The
// output is made up: a crowd of boxes of people's size, 80 classes and 32 mask coefficients as the published
// networks have. `ipl_slam segment` prints how long the network itself takes on pictures.
#include <vector>

#include <benchmark/benchmark.h>

#include "common/random.hpp"
#include "segmentation/letterbox.hpp"
#include "segmentation/nms.hpp"
#include "segmentation/yolo_output.hpp"

namespace {

using namespace ipl_slam;

constexpr int kClasses = 80, kCoefficients = 32;
constexpr int kPeople = 8, kProposals = 12;  // per image, and anchors that propose each of them
const cv::Size kImage(640, 480);

/// The output of a network with an input of this size.
struct MadeOutput {
  explicit MadeOutput(cv::Size input) {
    Random random(1);
    output.anchors = input.area() * 21 / 1024;
    output.classes = kClasses;
    output.coefficients = kCoefficients;
    output.prototype_size = input / 4;
    for (int i = 0; i < (4 + kClasses + kCoefficients) * output.anchors; ++i) {
      const bool score = i >= 4 * output.anchors && i < (4 + kClasses) * output.anchors;
      channels.push_back(static_cast<float>(score ? random.uniform(0.0, 0.01) : random.uniform(-1.0, 1.0)));
    }
    for (int i = 0; i < kCoefficients * output.prototype_size.area(); ++i) {
      prototypes.push_back(static_cast<float>(random.uniform(-1.0, 1.0)));
    }
    for (int person = 0; person < kPeople; ++person) {
      const float x = static_cast<float>(input.width * (person + 0.5) / kPeople);
      for (int proposal = 0; proposal < kProposals; ++proposal) {
        const int anchor = (person * kProposals + proposal) * output.anchors / (kPeople * kProposals);
        set(0, anchor, x + static_cast<float>(proposal) * 0.2F);
        set(1, anchor, 0.5F * static_cast<float>(input.height));
        set(2, anchor, 0.25F * static_cast<float>(input.width));
        set(3, anchor, 0.7F * static_cast<float>(input.height));
        set(4, anchor, 0.5F + 0.03F * static_cast<float>(proposal));
      }
    }
    output.channels = channels.data();
    output.prototypes = prototypes.data();
  }
  void set(int channel, int anchor, float value) {
    channels[static_cast<std::size_t>(channel * output.anchors + anchor)] = value;
  }

  std::vector<float> channels, prototypes;
  YoloOutput output;
};

cv::Size input_size(const benchmark::State& state) {
  return {static_cast<int>(state.range(0)), static_cast<int>(state.range(1))};
}

void fill_input(benchmark::State& state) {
  const cv::Mat image(kImage, CV_8UC3, cv::Scalar(10, 20, 30));
  const Letterbox letterbox(kImage, input_size(state));
  std::vector<float> planes;
  for (auto _ : state) fill_letterbox(image, letterbox, planes);
}

void find_people(benchmark::State& state) {
  const MadeOutput made(input_size(state));
  const std::vector<bool> all(kClasses, true);
  for (auto _ : state) {
    benchmark::DoNotOptimize(suppress_overlaps(find_candidates(made.output, 0.3F, all), 0.7F, 100));
  }
}

void decode_people(benchmark::State& state) {
  const MadeOutput made(input_size(state));
  const Letterbox letterbox(kImage, input_size(state));
  const auto people =
      suppress_overlaps(find_candidates(made.output, 0.3F, std::vector<bool>(kClasses, true)), 0.7F, 100);
  for (auto _ : state) {
    for (const Detection& person : people) {
      benchmark::DoNotOptimize(decode_mask(made.output, person, image_box(person, letterbox), letterbox));
    }
  }
  state.counters["people"] = static_cast<double>(people.size());
}

void sizes(benchmark::internal::Benchmark* benchmark) {
  benchmark->Args({640, 640})
      ->Args({640, 480})
      ->Args({480, 384})
      ->Args({320, 256})
      ->Unit(benchmark::kMicrosecond);
}

BENCHMARK(fill_input)->Apply(sizes);
BENCHMARK(find_people)->Apply(sizes);
BENCHMARK(decode_people)->Apply(sizes);

}  // namespace
