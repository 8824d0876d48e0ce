#pragma once

#include <cassert>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/ids.hpp"

namespace ipl_slam {

/// Flat store of records under strong ids. Ids count up and are never used again, so they order records by
/// age and an old id can never mean a new record. The memory of erased records is used again: what stays of
/// them is four bytes.
template <class IdType, class Record>
class Store {
 public:
  /// Adds a record and returns its id.
  IdType insert(Record record) {
    const IdType id{static_cast<std::uint32_t>(slot_of_.size())};
    if (free_.empty()) {
      slot_of_.push_back(static_cast<std::uint32_t>(records_.size()));
      records_.push_back(std::move(record));
    } else {
      slot_of_.push_back(free_.back());
      records_[free_.back()] = std::move(record);
      free_.pop_back();
    }
    ++size_;
    return id;
  }

  void erase(IdType id) {
    assert(contains(id));
    const std::uint32_t slot = std::exchange(slot_of_[id.value], IdType::kInvalid);
    records_[slot] = Record{};
    free_.push_back(slot);
    --size_;
  }

  [[nodiscard]] bool contains(IdType id) const {
    return id.value < slot_of_.size() && slot_of_[id.value] != IdType::kInvalid;
  }
  [[nodiscard]] const Record& operator[](IdType id) const {
    assert(contains(id));
    return records_[slot_of_[id.value]];
  }
  [[nodiscard]] Record& operator[](IdType id) {
    assert(contains(id));
    return records_[slot_of_[id.value]];
  }
  [[nodiscard]] std::size_t size() const { return size_; }
  /// Ids given out so far, alive or not.
  [[nodiscard]] std::size_t ids_used() const { return slot_of_.size(); }

  /// Calls fn(id, record) in order of ids.
  template <class Fn>
  void for_each(Fn&& fn) const {
    for (std::uint32_t i = 0; i < slot_of_.size(); ++i) {
      if (slot_of_[i] != IdType::kInvalid) fn(IdType{i}, records_[slot_of_[i]]);
    }
  }

 private:
  std::vector<std::uint32_t> slot_of_;
  std::vector<Record> records_;
  std::vector<std::uint32_t> free_;
  std::size_t size_ = 0;
};

}  // namespace ipl_slam
