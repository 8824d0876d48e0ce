// What happens to a keyframe before it enters the cloud, 640 x 480: a rendered view with the noise of a depth
// camera, in which two people stand close before the camera.
#include <benchmark/benchmark.h>

#include "dataset/camera_config.hpp"
#include "dataset/synthetic/synthetic_source.hpp"
#include "dense/depth_codec.hpp"
#include "dense/label_codec.hpp"
#include "dense/left_out.hpp"
#include "dense/view_maker.hpp"
#include "dense/view_store.hpp"

namespace {

using namespace ipl_slam;

struct Keyframe {
  Keyframe() {
    SyntheticOptions options;
    options.story = "stand";
    options.people = 2;
    options.trajectory = "static";
    const SyntheticSource source(options);
    frame = source.render(0);
    for (const SyntheticObject& object : source.objects()) {
      const BitMask mask = BitMask::from_image(frame.mask == object.id);
      if (mask.none()) continue;
      const InstanceId id{static_cast<std::uint32_t>(object.id)};
      instances.push_back({id, {object.class_name, 0.9F, mask.bounding_box(), mask}});
    }
    view = ViewMaker(camera).make(0.0, frame.rgbd.color, frame.rgbd.depth, instances);
  }

  Camera camera = load_camera("tum1");  // for its distortion
  SyntheticFrame frame;
  std::vector<TrackedInstance> instances;
  DenseView view;
};

const Keyframe& keyframe() {
  static const Keyframe made;
  return made;
}

void make_view(benchmark::State& state) {
  const Keyframe& k = keyframe();
  const ViewMaker maker(k.camera);
  for (auto _ : state) {
    benchmark::DoNotOptimize(maker.make(0.0, k.frame.rgbd.color, k.frame.rgbd.depth, k.instances));
  }
}

void depth_packed(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(pack_depth(keyframe().view.depth));
  state.counters["smaller"] = static_cast<double>(keyframe().view.depth.total() * 2) /
                              static_cast<double>(pack_depth(keyframe().view.depth).size());
}

void depth_unpacked(benchmark::State& state) {
  const cv::Mat& depth = keyframe().view.depth;
  const std::string bytes = pack_depth(depth);
  for (auto _ : state) benchmark::DoNotOptimize(unpack_depth(bytes, depth.size()));
}

void labels_packed(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(pack_labels(keyframe().view.labels));
}

void view_stored(benchmark::State& state) {
  ViewStore store(keyframe().view.depth.size());
  std::uint32_t id = 0;
  for (auto _ : state) store.add(KeyframeId{id++}, keyframe().view);
}

// Argument: LeftOutOptions::reach.
void left_out(benchmark::State& state) {
  const DenseView& view = keyframe().view;
  const Camera camera = pinhole(keyframe().camera);
  LeftOutOptions options;
  options.reach = static_cast<int>(state.range(0));
  for (auto _ : state) {
    benchmark::DoNotOptimize(left_out_mask(view.labels, view.depth, view.instances, {}, camera, options));
  }
}

BENCHMARK(make_view)->Unit(benchmark::kMillisecond);
BENCHMARK(depth_packed)->Unit(benchmark::kMillisecond);
BENCHMARK(depth_unpacked)->Unit(benchmark::kMillisecond);
BENCHMARK(labels_packed)->Unit(benchmark::kMillisecond);
BENCHMARK(view_stored)->Unit(benchmark::kMillisecond);
BENCHMARK(left_out)->Arg(0)->Arg(LeftOutOptions{}.reach)->Unit(benchmark::kMillisecond);

}  // namespace
