#include "dense/voxel_grid.hpp"

#include <algorithm>
#include <cmath>

namespace ipl_slam {
namespace {

// Rounds down, also below 0.
constexpr std::int32_t block_index(std::int32_t voxel) {
  return voxel >> 3;
}
static_assert(VoxelBlock::kSide == 8);

}  // namespace

VoxelCoord VoxelGrid::voxel_of(const Eigen::Vector3d& point_w) const {
  const Eigen::Vector3d v = (point_w / voxel_size_).array().floor();
  return {static_cast<std::int32_t>(v.x()), static_cast<std::int32_t>(v.y()),
          static_cast<std::int32_t>(v.z())};
}

BlockCoord VoxelGrid::block_of(const VoxelCoord& v) {
  return {block_index(v.x), block_index(v.y), block_index(v.z)};
}

std::size_t VoxelGrid::index_in_block(const VoxelCoord& v) {
  constexpr int kMask = VoxelBlock::kSide - 1;
  return VoxelBlock::index(v.x & kMask, v.y & kMask, v.z & kMask);
}

VoxelBlock* VoxelGrid::find(const BlockCoord& place) {
  const auto it = index_.find(place);
  return it == index_.end() ? nullptr : blocks_[it->second].block.get();
}

const VoxelBlock* VoxelGrid::find(const BlockCoord& place) const {
  const auto it = index_.find(place);
  return it == index_.end() ? nullptr : blocks_[it->second].block.get();
}

VoxelBlock& VoxelGrid::make(const BlockCoord& place) {
  const auto [it, is_new] = index_.try_emplace(place, static_cast<std::uint32_t>(blocks_.size()));
  if (is_new) blocks_.push_back({place, std::make_unique<VoxelBlock>()});
  return *blocks_[it->second].block;
}

void VoxelGrid::erase(const BlockCoord& place) {
  const auto it = index_.find(place);
  if (it == index_.end()) return;
  const std::uint32_t gap = it->second;
  index_.erase(it);
  if (gap + 1 != blocks_.size()) {
    blocks_[gap] = std::move(blocks_.back());
    index_[blocks_[gap].place] = gap;
  }
  blocks_.pop_back();
}

std::vector<BlockCoord> VoxelGrid::sorted() const {
  std::vector<BlockCoord> places;
  places.reserve(blocks_.size());
  for (const Entry& entry : blocks_) places.push_back(entry.place);
  std::sort(places.begin(), places.end());
  return places;
}

std::size_t VoxelGrid::bytes() const {
  // A node of the index: the pair, a pointer to the next node and the allocator's own word.
  constexpr std::size_t kNode = sizeof(BlockCoord) + sizeof(std::uint32_t) + 2 * sizeof(void*);
  return blocks_.size() * sizeof(VoxelBlock) + blocks_.capacity() * sizeof(Entry) + index_.size() * kNode +
         index_.bucket_count() * sizeof(void*);
}

}  // namespace ipl_slam
