#pragma once

#include <cmath>
#include <cstdint>
#include <functional>

#include <Eigen/Geometry>

#include "dense/voxel_grid.hpp"

namespace ipl_slam {

constexpr double kVoxel = 0.01;
constexpr double kTruncation = 0.04;
constexpr int kSeen = 16;  ///< weight of one near view

using DistanceFunction = std::function<double(const Eigen::Vector3d&)>;

/// Sets a voxel, as one view of this weight would.
inline void set_voxel(VoxelGrid& grid, const VoxelCoord& v, double distance, int weight = kSeen) {
  VoxelBlock& block = grid.make(VoxelGrid::block_of(v));
  const std::size_t i = VoxelGrid::index_in_block(v);
  block.weight[i] = static_cast<std::uint16_t>(weight);
  block.distance[i] =
      weight * static_cast<std::int32_t>(std::lround(distance / kTruncation * VoxelBlock::kDistanceSteps));
}

/// Fills the voxels from low to high (both included) that lie nearer to a surface than the truncation.
inline void fill(VoxelGrid& grid, const VoxelCoord& low, const VoxelCoord& high,
                 const DistanceFunction& distance, int weight = kSeen) {
  for (int z = low.z; z <= high.z; ++z) {
    for (int y = low.y; y <= high.y; ++y) {
      for (int x = low.x; x <= high.x; ++x) {
        const double d = distance(grid.centre({x, y, z}));
        if (std::abs(d) < kTruncation) set_voxel(grid, {x, y, z}, d, weight);
      }
    }
  }
}

inline DistanceFunction plane(const Eigen::Vector3d& normal, double offset) {
  return [n = normal.normalized().eval(), offset](const Eigen::Vector3d& p) { return n.dot(p) - offset; };
}

inline DistanceFunction sphere(const Eigen::Vector3d& centre, double radius) {
  return [=](const Eigen::Vector3d& p) { return (p - centre).norm() - radius; };
}

/// The exact distance to a box about the origin.
inline DistanceFunction box(const Eigen::Vector3d& half) {
  return [=](const Eigen::Vector3d& p) {
    const Eigen::Array3d q = p.array().abs() - half.array();
    return q.max(0.0).matrix().norm() + std::min(q.maxCoeff(), 0.0);
  };
}

}  // namespace ipl_slam
