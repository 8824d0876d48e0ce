#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "dense/voxel_grid.hpp"

namespace ipl_slam {

/// Distinct blocks in the order in which they were first put in. Made for a view's ten thousands of samples
/// that fall into a few thousand blocks: a table with open addressing, no allocation per block.
class BlockSet {
 public:
  BlockSet() : slots_(kFirstSlots, kEmpty) {}

  void insert(const BlockCoord& place) {
    std::uint32_t& slot = slots_[slot_of(place)];
    if (slot != kEmpty) return;
    slot = static_cast<std::uint32_t>(places_.size());
    places_.push_back(place);
    if (2 * places_.size() > slots_.size()) grow();
  }
  [[nodiscard]] std::vector<BlockCoord> take() && { return std::move(places_); }

 private:
  static constexpr std::size_t kFirstSlots = 8192;  // a power of two, like all their numbers
  static constexpr std::uint32_t kEmpty = 0xFFFFFFFFU;

  // The slot of a place, or the empty one that it would take.
  [[nodiscard]] std::size_t slot_of(const BlockCoord& place) const {
    const std::size_t mixed = PlaceHash{}(place);
    std::size_t i = (mixed ^ mixed >> 15U) & (slots_.size() - 1);
    while (slots_[i] != kEmpty && places_[slots_[i]] != place) i = (i + 1) & (slots_.size() - 1);
    return i;
  }
  void grow() {
    slots_.assign(2 * slots_.size(), kEmpty);
    for (std::size_t i = 0; i < places_.size(); ++i) {
      slots_[slot_of(places_[i])] = static_cast<std::uint32_t>(i);
    }
  }

  std::vector<BlockCoord> places_;
  std::vector<std::uint32_t> slots_;
};

}  // namespace ipl_slam
