#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "pipeline/config.hpp"
#include "pipeline/keyframe_lines.hpp"
#include "pipeline/map_keeper.hpp"

namespace ipl_slam {

/// How long a keyframe took, milliseconds, and what it took out.
struct MappingRecord {
  std::size_t frame_index = 0;
  double lines = 0.0;    ///< extraction of its lines, comparison with the keyframe before
  double mapping = 0.0;  ///< the mapper
  /// Landmarks that left the map because they sat on something that turned out to move.
  std::vector<std::pair<InstanceId, RemovedLandmarks>> removed = {};
};

/// Where and when lines are extracted and the mapper runs. The stages on either side do not know.
class MappingSchedule {
 public:
  virtual ~MappingSchedule() = default;

  /// Starts the map; the local map is there when this returns.
  virtual void start(NewKeyframe first) = 0;
  virtual void submit(NewKeyframe keyframe) = 0;
  /// The newest local map; null before start(). Throws what went wrong on another thread.
  [[nodiscard]] virtual std::shared_ptr<const LocalMap> local_map() const = 0;
  /// Whether a keyframe submitted now would be worked on at once.
  [[nodiscard]] virtual bool idle() const = 0;
  /// Whether another keyframe may be submitted.
  [[nodiscard]] virtual bool has_room() const = 0;
  /// What the lines of the newest keyframe that has regions told about them; empty if nothing since the last
  /// call.
  [[nodiscard]] virtual std::vector<RegionLines> take_region_lines() = 0;
  /// Looks for the place where a lost frame was taken, in all of the map. In lockstep the answer is there at
  /// once; in realtime it is that to an earlier frame, or nothing yet: one frame is looked for at a time.
  [[nodiscard]] virtual std::optional<FoundPlace> find_place(const TrackedFrame& lost) = 0;
  /// The camera was found at this place: its local map becomes the one to go on with.
  virtual void resume_at(const FoundPlace& place) = 0;
  /// Has a local map around this keyframe follow, for a camera that moves on without making keyframes.
  virtual void move_to(KeyframeId id) = 0;
  /// Waits until everything submitted is in the map.
  virtual void finish() = 0;
  /// The known places that were recognised so far.
  [[nodiscard]] virtual std::vector<PlaceEvent> events() const = 0;
  /// Calls fn with the map while the mapper rests.
  virtual void read(const std::function<void(const Map&, const std::vector<MappingRecord>&)>& fn) const = 0;
};

/// Everything happens inside the calls: fixed order, repeatable results. No lines without an extractor.
[[nodiscard]] std::unique_ptr<MappingSchedule> make_lockstep_mapping(MapKeeper keeper,
                                                                     std::optional<KeyframeLines> lines);

}  // namespace ipl_slam
