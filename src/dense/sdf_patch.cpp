#include "dense/sdf_patch.hpp"

#include <cmath>
#include <limits>

namespace ipl_slam {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

struct Range {
  int first, last;
};

// The voxels of the block that lies `d` blocks further which belong to the patch, counted from the patch's
// block.
Range range_of(int d) {
  constexpr int kSide = VoxelBlock::kSide;
  return d < 0 ? Range{-1, -1} : d > 0 ? Range{kSide, kSide} : Range{0, kSide - 1};
}

}  // namespace

SdfPatch::SdfPatch(const VoxelGrid& grid, double truncation, const SurfaceOptions& options)
    : grid_(&grid),
      min_weight_(static_cast<float>(options.min_weight)),
      carve_(static_cast<float>(options.carve)),
      scale_(static_cast<float>(truncation / grid.voxel_size() / VoxelBlock::kDistanceSteps)) {}

bool SdfPatch::load(const BlockCoord& place, float reach) {
  distances_.fill(kUnknown);
  copy(*grid_->find(place), 0, 0, 0);
  bool near = false;
  for (const float d : distances_) near |= std::abs(d) < reach;  // false for NaN
  if (!near) return false;
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        if (dx == 0 && dy == 0 && dz == 0) continue;
        const VoxelBlock* block = grid_->find({place.x + dx, place.y + dy, place.z + dz});
        if (block != nullptr) copy(*block, dx, dy, dz);
      }
    }
  }
  return true;
}

void SdfPatch::copy(const VoxelBlock& block, int dx, int dy, int dz) {
  constexpr int kMask = VoxelBlock::kSide - 1;
  const Range rx = range_of(dx), ry = range_of(dy), rz = range_of(dz);
  for (int z = rz.first; z <= rz.last; ++z) {
    for (int y = ry.first; y <= ry.last; ++y) {
      for (int x = rx.first; x <= rx.last; ++x) {
        distances_[static_cast<std::size_t>(index(x, y, z))] =
            distance(block, VoxelBlock::index(x & kMask, y & kMask, z & kMask));
      }
    }
  }
}

float SdfPatch::distance(const VoxelBlock& block, std::size_t voxel) const {
  const auto weight = static_cast<float>(block.weight[voxel]);
  if (weight < min_weight_ || static_cast<float>(block.free[voxel]) > carve_ * weight) return kUnknown;
  return static_cast<float>(block.distance[voxel]) * scale_ / weight;
}

}  // namespace ipl_slam
