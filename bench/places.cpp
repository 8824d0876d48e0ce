// Time of a place look-up, and of adding and removing a keyframe, at 1000 keyframes of 1000 features.

#include <cstdint>
#include <vector>

#include <benchmark/benchmark.h>

#include "common/random.hpp"
#include "dataset/synthetic/synthetic_source.hpp"
#include "features/orb_extractor.hpp"
#include "loop/place_index.hpp"

namespace {

using namespace ipl_slam;

using Picture = std::vector<Descriptor>;

constexpr std::uint32_t kKeyframes = 1000;
constexpr std::uint32_t kViewsPerPlace = 10;
constexpr std::size_t kFeatures = 1000;
constexpr int kRendered = 24;
// Share of the bits taken from another corner. Two corners differ in about 45 % of the bits, so a sixth puts
// each sight of a corner 7.5 % off it and two sights some 14 % apart; three quarters make another corner with
// bits as skewed and as correlated as those of real ones.
constexpr double kSameCorner = 0.167, kOtherCorner = 0.75;
constexpr double kLost = 0.4;  // share of the corners not found again from view to view

std::vector<Picture> rendered_pictures() {
  SyntheticOptions options;
  options.frames = kRendered;
  const SyntheticSource source(options);
  OrbExtractor extractor({}, source.camera(), {});
  std::vector<Picture> pictures;
  for (int i = 0; i < kRendered; ++i) {
    const SyntheticFrame frame = source.render(static_cast<std::size_t>(i));
    pictures.push_back(extractor.extract(frame.rgbd.color, frame.rgbd.depth).descriptors);
  }
  return pictures;
}

Descriptor mixed(Descriptor a, const Descriptor& b, double share, Random& random) {
  for (std::size_t i = 0; i < 256; ++i) {
    const std::uint64_t bit = std::uint64_t{random.chance(share)} << (i % 64);
    a[i / 64] ^= (a[i / 64] ^ b[i / 64]) & bit;
  }
  return a;
}

struct World {
  std::vector<Picture> keyframes, queries;  // ten views of each place, and one more of each
  PlaceIndex index{{}};

  World() {
    const std::vector<Picture> rendered = rendered_pictures();
    Random random(1);
    const auto any = [&]() -> const Descriptor& {
      const Picture& picture = rendered[random.index(rendered.size())];
      return picture[random.index(picture.size())];
    };
    Picture place(kFeatures);
    for (std::uint32_t i = 0; i < kKeyframes; ++i) {
      if (i % kViewsPerPlace == 0) {
        for (Descriptor& d : place) d = mixed(any(), any(), kOtherCorner, random);
        queries.push_back(view_of(place, any, random));
      }
      keyframes.push_back(view_of(place, any, random));
      index.add(KeyframeId{i}, keyframes.back());
    }
  }

  template <class Any>
  static Picture view_of(const Picture& place, const Any& any, Random& random) {
    Picture view;
    for (const Descriptor& corner : place) {
      view.push_back(random.chance(kLost) ? mixed(any(), any(), kOtherCorner, random)
                                          : mixed(corner, any(), kSameCorner, random));
    }
    return view;
  }
};

World& world() {
  static World world;
  return world;
}

void lookup(benchmark::State& state) {
  const World& w = world();
  std::size_t i = 0, right = 0, asked = 0;
  for (auto _ : state) {
    const auto found = w.index.query(w.queries[i], [](KeyframeId) { return true; });
    right += !found.empty() && found[0].keyframe.value / kViewsPerPlace == i ? 1 : 0;
    ++asked;
    i = (i + 1) % w.queries.size();
  }
  state.counters["right"] = static_cast<double>(right) / static_cast<double>(asked);
}
BENCHMARK(lookup)->Unit(benchmark::kMillisecond);

void remove_and_add(benchmark::State& state) {
  World& w = world();
  std::uint32_t i = 0;
  for (auto _ : state) {
    w.index.remove(KeyframeId{i});
    w.index.add(KeyframeId{i}, w.keyframes[i]);
    i = (i + 37) % kKeyframes;
  }
}
BENCHMARK(remove_and_add)->Unit(benchmark::kMillisecond);

}  // namespace
