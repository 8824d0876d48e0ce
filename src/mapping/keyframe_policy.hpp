#pragma once

#include "common/options.hpp"
#include "map/local_map.hpp"
#include "tracking/tracked_frame.hpp"

namespace ipl_slam {

struct KeyframePolicyOptions {
  double max_interval = 0.33;
  double min_interval = 0.0;
  double min_shared = 0.75;
  int min_close_tracked = 100;
  int max_close_untracked = 70;
  double close_depth = 3.0;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("max_interval", max_interval,
             {0.0, 3600.0, "s", "a keyframe is due at the latest after this time"});
    v.number("min_interval", min_interval, {0.0, 3600.0, "s", "no keyframe sooner than this after the last"});
    v.number(
        "min_shared", min_shared,
        {0.0, 1.0, "ratio", "a keyframe is due when fewer of the reference keyframe's landmarks are seen"});
    v.number("min_close_tracked", min_close_tracked,
             {0, 10000, "count", "a keyframe is due when fewer close landmarks are seen than this ..."});
    v.number("max_close_untracked", max_close_untracked,
             {0, 10000, "count", "... while more close keypoints than this have no landmark yet"});
    v.number("close_depth", close_depth, {0.1, 100.0, "m", "what is nearer is close: its depth is good"});
  }
};

/// Decides which tracked frames become keyframes (the criteria of Mur-Artal and Tardos, "ORB-SLAM2", T-RO
/// 2017, V-B).
class KeyframePolicy {
 public:
  explicit KeyframePolicy(const KeyframePolicyOptions& options) : options_(options) {}

  /// `mapper_idle` is false while the mapper still works on an earlier keyframe: then only a frame that is
  /// about to lose the map becomes one. Remembers the frames it said yes to.
  [[nodiscard]] bool wants(const TrackedFrame& tracked, const LocalMap& map, bool mapper_idle);
  /// The frame that started the map.
  void started_with(const Frame& frame) { last_keyframe_ = frame.timestamp; }

 private:
  KeyframePolicyOptions options_;
  double last_keyframe_ = 0.0;  // timestamp, s
};

}  // namespace ipl_slam
