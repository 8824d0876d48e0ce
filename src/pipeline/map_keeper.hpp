#pragma once

#include <atomic>
#include <memory>

#include "map/local_map.hpp"
#include "mapping/local_mapper.hpp"

namespace ipl_slam {

/// Owns the map and does with it what a keyframe sets off: local mapping, closing of loops, merging of parts.
/// Everything happens on the calling thread; the schedules decide which that is.
class MapKeeper {
 public:
  MapKeeper(Map map, LocalMapper mapper, const LocalMapOptions& local_map)
      : map_(std::move(map)), mapper_(std::move(mapper)), local_map_(local_map) {}

  /// Takes a keyframe in and returns the local map around it. Bundle adjustment ends early when `abort`, if
  /// not null, is raised.
  [[nodiscard]] std::shared_ptr<const LocalMap> add(const KeyframeCandidate& candidate,
                                                    const std::atomic<bool>* abort = nullptr);
  [[nodiscard]] const Map& map() const { return map_; }
  /// What the last keyframe took out of the map because it sat on something that turned out to move.
  [[nodiscard]] const std::vector<std::pair<InstanceId, RemovedLandmarks>>& removed() const {
    return mapper_.removed();
  }

 private:
  Map map_;
  LocalMapper mapper_;
  LocalMapOptions local_map_;
};

}  // namespace ipl_slam
