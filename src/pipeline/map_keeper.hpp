#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "loop/global_bundle.hpp"
#include "loop/loop_closer.hpp"
#include "map/local_map.hpp"
#include "mapping/local_mapper.hpp"
#include "pipeline/config.hpp"

namespace ipl_slam {

/// A known place that was recognised.
struct PlaceEvent {
  enum class Kind {
    kLoop,        ///< a loop was closed
    kMerge,       ///< two parts of the map became one
    kRelocalized  ///< a lost camera was found again
  };
  Kind kind = Kind::kLoop;
  std::size_t frame_index = 0;  ///< of the keyframe or lost frame that shows it
  std::size_t known_index = 0;  ///< of the frame of the keyframe it was compared with
  int inliers = 0;              ///< landmarks that agree on the pose
  double translation = 0.0;     ///< of a loop: by how much the keyframe was corrected, m
  double rotation = 0.0;        ///< the same, rad
};

/// "loop", "merge" or "relocalized".
[[nodiscard]] const char* to_string(PlaceEvent::Kind kind);

/// Where a lost frame was taken.
struct FoundPlace {
  std::shared_ptr<const LocalMap> map;  ///< around the place, in whatever part; LocalMap::found is set
  PlaceEvent event;
};

/// Owns the map and does with it what a keyframe sets off: local mapping, closing of loops, merging of parts.
/// Everything happens on the calling thread; the schedules decide which that is.
class MapKeeper {
 public:
  /// Goes on with `loaded`, if there is one.
  MapKeeper(const Camera& camera, const Config& config, std::optional<Map> loaded = std::nullopt);

  /// Takes a keyframe in and returns the local map around it. Bundle adjustment ends early when `abort`, if
  /// not null, is raised.
  [[nodiscard]] std::shared_ptr<const LocalMap> add(const KeyframeCandidate& candidate,
                                                    const std::atomic<bool>* abort = nullptr);
  /// The place where a lost frame was taken; nothing where it is not known.
  [[nodiscard]] std::optional<FoundPlace> find_place(const TrackedFrame& lost) const;
  /// Adds to the events one that only its user can tell: that a lost camera was found again.
  void note(const PlaceEvent& event) { events_.push_back(event); }
  /// The local map around the newest keyframe; null as long as there is none.
  [[nodiscard]] std::shared_ptr<const LocalMap> around_newest() const;
  /// The local map around a keyframe that is, or once was, in the map.
  [[nodiscard]] std::shared_ptr<const LocalMap> around(KeyframeId id) const;

  /// Whether a loop was closed in a part that global bundle adjustment was not begun of since.
  [[nodiscard]] bool wants_global_bundle() const { return !unsettled_.empty(); }
  /// The global bundle adjustment that is wanted, to be solved anywhere and then applied, one at a time.
  [[nodiscard]] GlobalBundle begin_global_bundle();
  /// Where it was aborted, or the map was corrected since it was begun, it is wanted anew and nothing else
  /// happens.
  void apply(const GlobalBundle& bundle);

  [[nodiscard]] const Map& map() const { return map_; }
  [[nodiscard]] const std::vector<PlaceEvent>& events() const { return events_; }
  /// What the last keyframe took out of the map because it sat on something that turned out to move.
  [[nodiscard]] const std::vector<std::pair<InstanceId, RemovedLandmarks>>& removed() const {
    return mapper_.removed();
  }

 private:
  void recognise(KeyframeId id);
  void follow_merge(PartId kept, PartId gone);

  Camera camera_;
  DepthNoiseOptions noise_;
  MappingOptions mapping_;
  Map map_;
  LocalMapper mapper_;
  std::optional<LoopCloser> loops_;  // nothing where places are not to be recognised
  LoopCorrection correction_;
  BundleOptions global_bundle_;
  std::vector<PlaceEvent> events_;
  int corrections_ = 0;
  int corrections_at_bundle_ = 0;  // when the last global bundle adjustment was begun
  PartId settling_;                // the part it is of; invalid once it was applied
  std::set<PartId> unsettled_;     // parts in which a loop was closed since
};

}  // namespace ipl_slam
