#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include <Eigen/Core>

#include "common/options.hpp"
#include "dense/range_image.hpp"
#include "dense/semantic_cloud.hpp"
#include "dense/voxel_grid.hpp"
#include "geometry/camera.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {

struct OccupancyOptions {
  double cell = 0.05;      ///< m
  int min_points = 2;      ///< count
  double max_range = 4.0;  ///< m
  int every = 4;           ///< pixels

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("cell", cell, {0.005, 10.0, "m", "edge of a cell"});
    v.number("min_points", min_points,
             {1, 65535, "count", "a cell with so many points of the cloud is occupied"});
    v.number("max_range", max_range, {0.1, 100.0, "m", "rays are followed so far"});
    v.number("every", every,
             {1, 64, "pixel", "every so many pixels of a view, across and down, a ray is followed"});
  }
};

enum class Occupancy { kUnknown, kFree, kOccupied };

/// Which cells of space are occupied and which are free: where a view's ray passed on its way to a surface
/// and no surface is. The state depends on what was added, not on the order.
class OccupancyGrid {
 public:
  struct Cell {
    VoxelCoord place;  ///< see low_corner()
    Occupancy state;
  };

  /// T_gw: the frame of the grid's axes from the world.
  explicit OccupancyGrid(const OccupancyOptions& options, const SE3& T_gw = {});

  /// Surfaces, in the world. What lies beyond 2^20 cells from the frame's origin is left out.
  void add_points(const std::vector<CloudPoint>& points);
  /// Follows rays of a view up to one cell before its surface, or to where the view surely saw through,
  /// through all cells on the way (Amanatides and Woo, "A fast voxel traversal algorithm for ray tracing",
  /// Eurographics 1987). camera: its distortion does not count.
  void add_rays(const RangeImage& view, const Camera& camera, const SE3& T_wc);

  [[nodiscard]] const OccupancyOptions& options() const { return options_; }
  [[nodiscard]] const SE3& T_gw() const { return T_gw_; }
  /// The cell that holds a point of the grid's frame.
  [[nodiscard]] Occupancy at(const Eigen::Vector3d& point_g) const;
  /// All that are not unknown, in order.
  [[nodiscard]] std::vector<Cell> cells() const;
  /// In the grid's frame, m.
  [[nodiscard]] Eigen::Vector3d low_corner(const VoxelCoord& place) const {
    return options_.cell * Eigen::Vector3d(place.x, place.y, place.z);
  }

 private:
  struct Block {
    std::array<std::uint16_t, VoxelBlock::kVoxels> points{};
    std::array<bool, VoxelBlock::kVoxels> seen_through{};
  };

  void see_through(const Eigen::Vector3d& from, const Eigen::Vector3d& to);
  [[nodiscard]] Occupancy state(const Block& block, std::size_t index) const;

  OccupancyOptions options_;
  SE3 T_gw_;
  std::map<BlockCoord, Block> blocks_;
};

}  // namespace ipl_slam
