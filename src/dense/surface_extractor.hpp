#pragma once

#include <vector>

#include <Eigen/Core>

#include "dense/surface_options.hpp"
#include "dense/voxel_grid.hpp"

namespace ipl_slam {

/// A place where the signed distance is 0.
struct SurfacePoint {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();  ///< world, m
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();    ///< unit, towards the free side
  VoxelCoord voxel;  ///< from whose centre it was found; no two points have the same
};

/// The surfaces in a volume, as points with normals. From the centre of each voxel the gradient of the signed
/// distance (central differences; one-sided beside voxels of which nothing is known) leads to the surface;
/// the point counts if it lies in the voxel, or hardly outside where the voxel it lies in has none. Specks
/// are dropped (26-neighbourhood). truncation: that of the volume, m. In the order of blocks, then of voxels
/// in them.
[[nodiscard]] std::vector<SurfacePoint> extract_surface(const VoxelGrid& grid, double truncation,
                                                        const SurfaceOptions& options);

}  // namespace ipl_slam
