#include "dynamics/record_table.hpp"

namespace ipl_slam {

void RecordTable::add(InstanceId id, std::size_t frame) {
  records_[id] = {frame, frame, std::nullopt};
}

void RecordTable::saw(InstanceId id, std::size_t frame) {
  if (const auto found = records_.find(id); found != records_.end()) found->second.seen = frame;
}

void RecordTable::check(InstanceId id, std::size_t since, std::size_t frame, bool still) {
  Record& record = records_.at(id);
  const bool unbroken = record.still_since && since <= record.checked;
  record.checked = frame;
  if (!still) {
    record.still_since.reset();
    return;
  }
  if (!unbroken) record.still_since = since;
  if (frame - *record.still_since >= window_) records_.erase(id);
}

void RecordTable::forget_unseen(std::size_t frame) {
  std::erase_if(records_, [&](const auto& entry) { return frame - entry.second.seen > forget_after_; });
}

}  // namespace ipl_slam
