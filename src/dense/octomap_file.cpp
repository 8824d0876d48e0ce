#include "dense/octomap_file.hpp"

#include <locale>
#include <sstream>

#include <octomap/OcTree.h>

#include <ipl_slam/error.hpp>

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
  std::ostringstream bytes;
  bytes.imbue(std::locale::classic());
  if (!tree.writeBinary(bytes)) throw UserError("OctoMap could not write the tree");
  return bytes.str();
}

}  // namespace ipl_slam
