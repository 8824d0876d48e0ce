#pragma once

#include <atomic>
#include <set>

#include "map/map.hpp"
#include "mapping/bundle_adjustment.hpp"
#include "mapping/map_bundle.hpp"

namespace ipl_slam {

struct LocalBundleOptions {
  int max_keyframes = 20;
  int max_fixed_keyframes = 30;
  int min_shared = 15;
  double line_sigma = 1.0;
  double line_depth_sigma = 0.01;
  BundleOptions solver;

  [[nodiscard]] LineNoise line_noise() const { return {line_sigma, line_depth_sigma}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("max_keyframes", max_keyframes, {1, 1000, "count", "keyframes whose poses are optimised"});
    v.number("max_fixed_keyframes", max_fixed_keyframes,
             {0, 1000, "count", "further keyframes that hold the window in place"});
    v.number("min_shared", min_shared,
             {1, 1000, "count", "landmarks a keyframe must share to be optimised along"});
    v.number(
        "line_sigma", line_sigma,
        {0.05, 20.0, "px",
         "standard deviation of a segment's end points across it, at octave 0; that of a keypoint is 1"});
    v.number("line_depth_sigma", line_depth_sigma,
             {0.0, 1.0, "1/m", "deviation of a segment's measured inverse depth beyond that of its fit"});
    v.section("solver", solver, "bundle adjustment");
  }
};

/// A keyframe and those that share most landmarks with it, at least `min_shared`; at most `limit` in all.
[[nodiscard]] std::set<KeyframeId> keyframes_around(const Map& map, KeyframeId centre, int limit,
                                                    int min_shared);

/// Of the other keyframes that see landmarks of `free`, those that see most of them; at most `limit`.
/// `among`, if not null, says which may be taken.
[[nodiscard]] std::set<KeyframeId> holding_keyframes(const Map& map, const std::set<KeyframeId>& free,
                                                     int limit, const std::set<KeyframeId>* among = nullptr);

/// Optimises the newest keyframe, those that share most landmarks with it, and the landmarks they see;
/// keyframes outside that also see them stay fixed. Observations that end as outliers leave the map,
/// unless `abort`, if not null, was raised meanwhile.
void adjust_local_bundle(Map& map, KeyframeId centre, const Camera& camera, const DepthNoiseOptions& noise,
                         const LocalBundleOptions& options, const std::atomic<bool>* abort);

}  // namespace ipl_slam
