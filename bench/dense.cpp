// The dense map: what a keyframe of 640 x 480 costs, and the memory that a floor takes.
#include <benchmark/benchmark.h>

#include "dataset/synthetic/depth_sensor.hpp"
#include "dataset/synthetic/synthetic_source.hpp"
#include "dense/range_image.hpp"
#include "dense/tsdf_volume.hpp"

namespace {

using namespace ipl_slam;

struct View {
  cv::Mat depth;  // raw
  RangeImage range;
  SE3 T_cw;
};

// A furnished room as a depth camera sees it on its way round, a view every two seconds.
struct Room {
  Camera camera;
  std::vector<View> views;

  Room() {
    SyntheticOptions options;
    options.fps = 0.5;
    const SyntheticSource source(options);
    camera = source.camera();
    for (std::size_t i = 0; i < 12; ++i) {
      const SyntheticFrame frame = source.render(i);
      views.push_back(
          {frame.rgbd.depth, make_range_image(frame.rgbd.depth, {}, camera, {}), frame.T_wc.inverse()});
    }
  }
};

const Room& room() {
  static const Room rendered;
  return rendered;
}

Simd body(const benchmark::State& state) {
  return state.range(0) == 0 ? Simd::portable : best_simd();
}

// A volume that knows the room. The view that is worked on is not in it.
struct Filled {
  TsdfVolume volume;
  TsdfVolume::Moment last = 0;
  const View& other = room().views[0];

  explicit Filled(Simd simd) : volume(room().camera, {}, simd) {
    for (std::size_t i = 1; i < room().views.size(); ++i) {
      last = volume.add(room().views[i].range, room().views[i].T_cw);
    }
  }
};

void range_image(benchmark::State& state) {
  const cv::Mat& depth = room().views[0].depth;
  for (auto _ : state) benchmark::DoNotOptimize(make_range_image(depth, {}, room().camera, {}));
}
BENCHMARK(range_image)->Unit(benchmark::kMillisecond);

void add_to_empty(benchmark::State& state) {
  const View& view = room().views[0];
  for (auto _ : state) {
    TsdfVolume volume(room().camera, {}, body(state));
    benchmark::DoNotOptimize(volume.add(view.range, view.T_cw));
  }
}
BENCHMARK(add_to_empty)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

void add(benchmark::State& state) {
  Filled filled(body(state));
  const View& view = filled.other;
  for (auto _ : state) {
    const TsdfVolume::Moment since = filled.volume.add(view.range, view.T_cw);
    state.PauseTiming();
    filled.volume.remove(view.range, view.T_cw, since);
    state.ResumeTiming();
  }
  state.counters["blocks"] = static_cast<double>(filled.volume.grid().blocks().size());
}
BENCHMARK(add)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

void remove(benchmark::State& state) {
  Filled filled(body(state));
  const View& view = filled.other;
  for (auto _ : state) {
    state.PauseTiming();
    const TsdfVolume::Moment since = filled.volume.add(view.range, view.T_cw);
    state.ResumeTiming();
    filled.volume.remove(view.range, view.T_cw, since);
  }
}
BENCHMARK(remove)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

// The last view brings blocks that the first has not seen.
void catch_up(benchmark::State& state) {
  const View& view = room().views[0];
  for (auto _ : state) {
    state.PauseTiming();
    TsdfVolume volume(room().camera, {}, body(state));
    const TsdfVolume::Moment since = volume.add(view.range, view.T_cw);
    static_cast<void>(volume.add(room().views[1].range, room().views[1].T_cw));
    state.ResumeTiming();
    benchmark::DoNotOptimize(volume.catch_up(view.range, view.T_cw, since));
  }
}
BENCHMARK(catch_up)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

// A floor of 10 x 10 m, seen from 1.4 m above it by 1000 views with a depth camera's noise.
View floor_view(const Camera& camera, std::uint64_t number) {
  // World: z up. Looks down by 40 degrees, turns by the golden angle from view to view.
  const double yaw = 2.399963 * static_cast<double>(number), pitch = 0.7;
  const Eigen::Vector3d eye(static_cast<double>(number % 32) / 31.0 * 8.0 - 4.0,
                            static_cast<double>(number / 32) / 31.0 * 8.0 - 4.0, 1.4);
  const Eigen::Vector3d forward(std::cos(yaw) * std::cos(pitch), std::sin(yaw) * std::cos(pitch),
                                -std::sin(pitch));
  Eigen::Matrix3d R_wc;
  R_wc.col(2) = forward;
  R_wc.col(0) = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
  R_wc.col(1) = R_wc.col(2).cross(R_wc.col(0));
  cv::Mat depth(camera.height, camera.width, CV_32FC1), incidence(depth.size(), CV_32FC1);
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const Eigen::Vector3d ray = R_wc * camera.unproject({u, v}, 1.0);
      const double z = ray.z() < 0.0 ? -eye.z() / ray.z() : 0.0;
      const Eigen::Vector3d hit = eye + z * ray;
      const bool on_floor = z > 0.0 && std::max(std::abs(hit.x()), std::abs(hit.y())) <= 5.0;
      depth.at<float>(v, u) = on_floor ? static_cast<float>(z) : 0.0F;
      incidence.at<float>(v, u) = static_cast<float>(-ray.z() / ray.norm());
    }
  }
  const cv::Mat raw = synthetic::depth_to_raw(synthetic::measure_depth(depth, incidence, camera, {}, number),
                                              camera.depth_scale);
  return {raw, make_range_image(raw, {}, camera, {}), SE3(R_wc, eye).inverse()};
}

void memory_of_floor(benchmark::State& state) {
  const Camera camera;
  for (auto _ : state) {
    TsdfVolume volume(camera, {});
    for (std::uint64_t i = 0; i < 1000; ++i) {
      const View view = floor_view(camera, i);
      static_cast<void>(volume.add(view.range, view.T_cw));
    }
    state.counters["MiB"] = static_cast<double>(volume.grid().bytes()) / (1 << 20);
    state.counters["blocks"] = static_cast<double>(volume.grid().blocks().size());
  }
}
BENCHMARK(memory_of_floor)->Iterations(1)->Unit(benchmark::kSecond);

}  // namespace
