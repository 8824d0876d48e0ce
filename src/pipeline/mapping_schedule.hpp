#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "mapping/local_mapper.hpp"
#include "pipeline/config.hpp"

namespace ipl_slam {

/// How long the mapper took for a keyframe.
struct MappingTime {
  std::size_t frame_index = 0;
  double milliseconds = 0.0;
};

/// Where and when the mapper runs. The stages on either side do not know.
class MappingSchedule {
 public:
  virtual ~MappingSchedule() = default;

  /// Starts the map; the local map is there when this returns.
  virtual void start(KeyframeCandidate first) = 0;
  virtual void submit(KeyframeCandidate candidate) = 0;
  /// The newest local map; null before start().
  [[nodiscard]] virtual std::shared_ptr<const LocalMap> local_map() const = 0;
  /// Whether a keyframe submitted now would be worked on at once.
  [[nodiscard]] virtual bool idle() const = 0;
  /// Whether another keyframe can be submitted without waiting.
  [[nodiscard]] virtual bool has_room() const = 0;
  /// Waits until everything submitted is in the map.
  virtual void finish() = 0;
  /// Calls fn with the map while the mapper rests.
  virtual void read(const std::function<void(const Map&, const std::vector<MappingTime>&)>& fn) const = 0;
};

/// The mapper runs inside submit(): fixed order, repeatable results.
[[nodiscard]] std::unique_ptr<MappingSchedule> make_lockstep_mapping(LocalMapper mapper);
/// The mapper runs on its own thread behind a bounded queue; a waiting keyframe cuts bundle adjustment short.
[[nodiscard]] std::unique_ptr<MappingSchedule> make_realtime_mapping(LocalMapper mapper,
                                                                     std::size_t queue_size);

}  // namespace ipl_slam
