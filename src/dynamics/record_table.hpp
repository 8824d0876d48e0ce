#pragma once

#include <cstddef>
#include <map>
#include <optional>

#include "common/ids.hpp"

namespace ipl_slam {

/// The instances that are known to move, so that their new masks are dynamic at once, without analysis. The
/// paper (end of section 3.3) proposes such a table per class as future work; here it is kept per instance,
/// so that of two people the seated one stays usable. Whether a known mover still moves is checked from time
/// to time; when every check over a whole window found it still, its record is dropped. Frames are numbers of
/// source frames.
class RecordTable {
 public:
  /// `window`: frames an instance must be still for; `forget_after`: frames a record outlives its instance.
  RecordTable(std::size_t window, std::size_t forget_after) : window_(window), forget_after_(forget_after) {}

  [[nodiscard]] bool contains(InstanceId id) const { return records_.contains(id); }

  /// Records that an instance was found moving.
  void add(InstanceId id, std::size_t frame);
  /// Notes that an instance is in the picture.
  void saw(InstanceId id, std::size_t frame);
  /// The last frame at which a recorded instance was found moving or was checked.
  [[nodiscard]] std::size_t last_check(InstanceId id) const { return records_.at(id).checked; }
  /// Enters a check of a recorded instance: did it stay still from frame `since` to `frame`? Drops the record
  /// where the checks now cover a whole window without motion.
  void check(InstanceId id, std::size_t since, std::size_t frame, bool still);
  /// Drops the records of instances that have not been seen for long.
  void forget_unseen(std::size_t frame);

 private:
  struct Record {
    std::size_t seen, checked;
    std::optional<std::size_t> still_since;  // start of the unbroken row of checks that found no motion
  };

  std::size_t window_, forget_after_;
  std::map<InstanceId, Record> records_;
};

}  // namespace ipl_slam
