#pragma once

#include <array>
#include <cstddef>

#include "dense/surface_options.hpp"
#include "dense/voxel_grid.hpp"

namespace ipl_slam {

/// Signed distances at the voxels of a block and one layer of voxels around it, so that what needs a voxel's
/// neighbours looks up blocks once per block.
class SdfPatch {
 public:
  static constexpr int kSide = VoxelBlock::kSide + 2;
  /// From one voxel to the next along x, y and z.
  static constexpr std::array<int, 3> kSteps{1, kSide, kSide* kSide};

  /// truncation: that of the volume, m. The grid must outlive the patch.
  SdfPatch(const VoxelGrid& grid, double truncation, const SurfaceOptions& options);

  /// Reads the block at this place, which must be there. False if no voxel in it is nearer than `reach` voxel
  /// sizes to a surface; then the layer around it is not read.
  bool load(const BlockCoord& place, float reach);

  /// Where a voxel lies in the patch; coordinates from -1 to VoxelBlock::kSide, counted from the block's own.
  [[nodiscard]] static constexpr int index(int x, int y, int z) {
    return ((z + 1) * kSide + y + 1) * kSide + x + 1;
  }
  /// Signed distance in voxel sizes, positive on the free side; not a number where nothing is known: not
  /// measured well enough, or carved away.
  [[nodiscard]] float operator[](int index) const { return distances_[static_cast<std::size_t>(index)]; }

 private:
  void copy(const VoxelBlock& block, int dx, int dy, int dz);
  [[nodiscard]] float distance(const VoxelBlock& block, std::size_t voxel) const;

  const VoxelGrid* grid_;
  float min_weight_, carve_;
  float scale_;  // voxel sizes per unit of VoxelBlock::distance
  std::array<float, kSide * kSide * kSide> distances_{};
};

}  // namespace ipl_slam
