#include "dense/tsdf_volume.hpp"

#include "dense/volume_view.hpp"
#include "dense/voxel_update.hpp"

namespace ipl_slam {
namespace {

// Takes what a view says into, or out of, the blocks that `wanted` picks by their birth.
template <class Wanted>
void update_blocks(const VoxelGrid& grid, const VolumeView& view, Sum sum, Simd simd, const Wanted& wanted) {
  for (const VoxelGrid::Entry& entry : grid.blocks()) {
    const float sight = view.sight(entry.place);
    if (sight == 0.0F || !wanted(entry.block->born)) continue;
    update_block(*entry.block, entry.place, view, sight, sum, simd);
  }
}

}  // namespace

TsdfVolume::TsdfVolume(const Camera& camera, const VolumeOptions& options, Simd simd)
    : camera_(camera), options_(options), simd_(simd), grid_(options.voxel) {}

// At all times, for every view that is in the volume and every block: the block holds the view's sums if it
// was born not after the view's moment, and then also the view's claim, if the view has its surface there.
// Blocks without claims do not exist.

TsdfVolume::Moment TsdfVolume::add(const RangeImage& view, const SE3& T_cw) {
  const VolumeView seen(view, T_cw, camera_, options_);
  const Moment next = clock_ + 1;
  for (const BlockCoord& place : seen.surface_blocks()) {
    VoxelBlock* block = grid_.find(place);
    if (block == nullptr) {
      if (is_full()) {
        ++refused_;
        continue;
      }
      block = &grid_.make(place);
      block->born = clock_ = next;
    }
    ++block->claims;
  }
  update_blocks(grid_, seen, Sum::kAdd, simd_, [](Moment) { return true; });
  return clock_;
}

void TsdfVolume::remove(const RangeImage& view, const SE3& T_cw, Moment since) {
  const VolumeView seen(view, T_cw, camera_, options_);
  for (const BlockCoord& place : seen.surface_blocks()) {
    VoxelBlock* block = grid_.find(place);
    if (block == nullptr || block->born > since) continue;
    if (--block->claims == 0) grid_.erase(place);
  }
  update_blocks(grid_, seen, Sum::kTakeOut, simd_, [since](Moment born) { return born <= since; });
}

TsdfVolume::Moment TsdfVolume::catch_up(const RangeImage& view, const SE3& T_cw, Moment since) {
  if (is_up_to_date(since)) return since;
  const VolumeView seen(view, T_cw, camera_, options_);
  // A block with the view's surface is older than the view, unless the view once found no room for it.
  if (refused_ > 0) {
    for (const BlockCoord& place : seen.surface_blocks()) {
      VoxelBlock* block = grid_.find(place);
      if (block != nullptr && block->born > since) ++block->claims;
    }
  }
  update_blocks(grid_, seen, Sum::kAdd, simd_, [since](Moment born) { return born > since; });
  return clock_;
}

bool TsdfVolume::is_full() const {
  return grid_.bytes() + sizeof(VoxelBlock) > static_cast<std::size_t>(options_.max_memory) << 20U;
}

}  // namespace ipl_slam
