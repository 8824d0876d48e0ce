#pragma once

#include <string>

#include "dense/occupancy_grid.hpp"

namespace ipl_slam {

/// Whether octomap_bt() works: liboctomap was there when the program was built.
[[nodiscard]] bool has_octomap();

/// A grid as OctoMap's binary tree (.bt; Hornung et al., "OctoMap: an efficient probabilistic 3D mapping
/// framework based on octrees", Autonomous Robots 2013), in the grid's frame, a leaf per cell; cells of one
/// kind are merged. Throws UserError in a build without liboctomap.
[[nodiscard]] std::string octomap_bt(const OccupancyGrid& grid);

}  // namespace ipl_slam
