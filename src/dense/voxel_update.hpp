#pragma once

#include "common/cpu.hpp"
#include "dense/volume_view.hpp"
#include "dense/voxel_grid.hpp"

namespace ipl_slam {

/// Which way a view's share of the sums goes.
enum class Sum { kAdd, kTakeOut };

/// Adds what a view says of a block's voxels to their sums, or takes it out again. Each voxel looks up the
/// ray nearest to its centre:
///   distance to the surface = incidence x (depth - z), if within the truncation;
///   free, where z is below the ray's `through` and the surface is not that near.
/// sight: view.sight(place); voxels behind are left alone.
/// Sums end at 65535 and at 0. Both bodies do the same operations in the same order, each exactly rounded.
void update_block(VoxelBlock& block, const BlockCoord& place, const VolumeView& view, float sight, Sum sum,
                  Simd simd);

}  // namespace ipl_slam
