#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "dense/voxel_grid.hpp"

namespace ipl_slam {

/// A set of places in blocks (voxels, edges: kBits per block) that numbers its members in their order: first
/// by block, then by place. One bit per place, so that it stays small where a table of numbers would not.
template <int kBits>
class BlockBits {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  /// Numbers of a block and of those around it, kNone where there is none.
  using Neighbours = std::array<std::uint32_t, 27>;

  /// An empty set. blocks: where there can be members, in order.
  explicit BlockBits(std::vector<BlockCoord> blocks) : places_(std::move(blocks)), blocks_(places_.size()) {}

  [[nodiscard]] const std::vector<BlockCoord>& places() const { return places_; }
  /// block: the number of a block in places().
  void insert(std::uint32_t block, std::size_t bit) { blocks_[block].words[bit / 64] |= mask(bit); }
  [[nodiscard]] bool contains(std::uint32_t block, std::size_t bit) const {
    return (blocks_[block].words[bit / 64] & mask(bit)) != 0;
  }

  /// Numbers the members; returns how many there are. To be called after the last insert().
  std::size_t number() {
    std::uint32_t count = 0;
    for (Block& block : blocks_) {
      for (std::size_t w = 0; w < kWords; ++w) {
        block.before[w] = count;
        count += static_cast<std::uint32_t>(std::popcount(block.words[w]));
      }
    }
    return count;
  }
  /// The number of a member.
  [[nodiscard]] std::uint32_t number_of(std::uint32_t block, std::size_t bit) const {
    const std::uint64_t below = blocks_[block].words[bit / 64] & (mask(bit) - 1);
    return blocks_[block].before[bit / 64] + static_cast<std::uint32_t>(std::popcount(below));
  }

  [[nodiscard]] Neighbours neighbours(std::uint32_t block) const {
    const BlockCoord& place = places_[block];
    Neighbours numbers;
    for (std::size_t k = 0; k < numbers.size(); ++k) {
      const int n = static_cast<int>(k);
      numbers[k] = find({place.x + n % 3 - 1, place.y + n / 3 % 3 - 1, place.z + n / 9 - 1});
    }
    return numbers;
  }
  /// Of the blocks around one, that which holds a voxel; coordinates from -1 to VoxelBlock::kSide, counted
  /// from the block in the middle.
  [[nodiscard]] static std::uint32_t holder(const Neighbours& around, int x, int y, int z) {
    static_assert(VoxelBlock::kSide == 8);
    return around[static_cast<std::size_t>(((z >> 3) * 3 + (y >> 3)) * 3 + (x >> 3) + 13)];
  }

 private:
  static constexpr std::size_t kWords = kBits / 64;
  static_assert(kBits % 64 == 0);

  struct Block {
    std::array<std::uint64_t, kWords> words{};
    std::array<std::uint32_t, kWords> before{};  // members ahead of those in the word
  };

  [[nodiscard]] static constexpr std::uint64_t mask(std::size_t bit) { return std::uint64_t{1} << bit % 64; }
  [[nodiscard]] std::uint32_t find(const BlockCoord& place) const {
    const auto it = std::lower_bound(places_.begin(), places_.end(), place);
    const bool found = it != places_.end() && *it == place;
    return found ? static_cast<std::uint32_t>(it - places_.begin()) : kNone;
  }

  std::vector<BlockCoord> places_;
  std::vector<Block> blocks_;
};

}  // namespace ipl_slam
