#include "dense/octomap_file.hpp"

#include <sstream>

#include <fmt/format.h>
#include <octomap/OcTree.h>

namespace ipl_slam {

bool has_octomap() {
  return true;
}

std::string octomap_bt(const OccupancyGrid& grid) {
  octomap::OcTree tree(grid.options().cell);
  for (const OccupancyGrid::Cell& cell : grid.cells()) {
    const Eigen::Vector3d centre = grid.low_corner(cell.place).array() + 0.5 * grid.options().cell;
    octomap::OcTreeKey key;
    // A tree holds 65536 cells a side.
    if (!tree.coordToKeyChecked(centre.x(), centre.y(), centre.z(), key)) continue;
    const bool occupied = cell.state == Occupancy::kOccupied;
    tree.setNodeValue(key, occupied ? tree.getClampingThresMaxLog() : tree.getClampingThresMinLog(), true);
  }
  tree.updateInnerOccupancy();
  tree.prune();
  // OcTree::writeBinary would do the same, but prints " done." to the terminal.
  std::ostringstream bytes;
  bytes << fmt::format(
      "# Octomap OcTree binary file\n# made by ipl_slam, metres\nid {}\nsize {}\nres {}\ndata\n",
      tree.getTreeType(), tree.size(), tree.getResolution());
  tree.writeBinaryData(bytes);
  return bytes.str();
}

}  // namespace ipl_slam
