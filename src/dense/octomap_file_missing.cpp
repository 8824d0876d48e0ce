// Stands in for octomap_file.cpp where CMake found no OctoMap.
#include <ipl_slam/error.hpp>

#include "dense/octomap_file.hpp"

namespace ipl_slam {

bool has_octomap() {
  return false;
}

std::string octomap_bt(const OccupancyGrid&) {
  throw UserError(
      "this build writes no OctoMap files: liboctomap was not found when it was built; install "
      "liboctomap-dev and "
      "build again");
}

}  // namespace ipl_slam
