#include "dense/occupancy_map.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

namespace ipl_slam {
namespace {

std::vector<OccupancyGrid::Cell> cells_between(const OccupancyGrid& grid, double low, double high) {
  std::vector<OccupancyGrid::Cell> cells = grid.cells();
  const double half = 0.5 * grid.options().cell;
  std::erase_if(cells, [&](const OccupancyGrid::Cell& cell) {
    const double middle = grid.low_corner(cell.place).z() + half;
    return middle < low || middle > high;
  });
  return cells;
}

}  // namespace

OccupancyMap occupancy_map(const OccupancyGrid& grid, const OccupancyMapOptions& options) {
  constexpr double kMostPixels = 1e8;
  const std::vector<OccupancyGrid::Cell> cells = cells_between(grid, options.low, options.high);
  if (cells.empty()) {
    throw UserError(
        fmt::format("nothing was seen between {:g} and {:g} m over the floor: there is no map to write",
                    options.low, options.high));
  }
  VoxelCoord low = cells.front().place, high = low;
  for (const OccupancyGrid::Cell& cell : cells) {
    low.x = std::min(low.x, cell.place.x), high.x = std::max(high.x, cell.place.x);
    low.y = std::min(low.y, cell.place.y), high.y = std::max(high.y, cell.place.y);
  }
  const cv::Size size(high.x - low.x + 1, high.y - low.y + 1);
  if (static_cast<double>(size.width) * size.height > kMostPixels) {
    throw UserError(fmt::format("a map of {}x{} cells is too large; make the cells larger than {:g} m",
                                size.width, size.height, grid.options().cell));
  }
  OccupancyMap map{cv::Mat(size, CV_8UC1, cv::Scalar(OccupancyMap::kUnknown)), grid.options().cell,
                   grid.low_corner(low).x(), grid.low_corner(low).y(), grid.T_gw()};
  for (const OccupancyGrid::Cell& cell : cells) {
    auto& pixel = map.image.at<std::uint8_t>(high.y - cell.place.y, cell.place.x - low.x);
    if (cell.state == Occupancy::kOccupied)
      pixel = OccupancyMap::kOccupied;
    else if (pixel == OccupancyMap::kUnknown)
      pixel = OccupancyMap::kFree;
  }
  return map;
}

std::string map_pgm(const OccupancyMap& map) {
  CV_Assert(map.image.type() == CV_8UC1 && map.image.isContinuous());
  std::string bytes = fmt::format("P5\n{} {}\n255\n", map.image.cols, map.image.rows);
  bytes.append(reinterpret_cast<const char*>(map.image.data), map.image.total());
  return bytes;
}

std::string map_yaml(const OccupancyMap& map, const std::string& image) {
  const Eigen::Vector3d& t = map.T_gw.translation();
  const Eigen::Quaterniond& q = map.T_gw.rotation();
  return fmt::format(
      "# made by ipl_slam; 0 occupied, 254 free, 205 unknown\n"
      "# map from world (that of cloud.ply and trajectory.txt), tx ty tz qx qy qz qw: {:.6f} {:.6f} {:.6f} "
      "{:.9f} "
      "{:.9f} {:.9f} {:.9f}\n"
      "image: {}\n"
      "resolution: {:g}\n"
      "origin: [{:.6f}, {:.6f}, 0]\n"
      "negate: 0\n"
      "occupied_thresh: 0.65\n"
      "free_thresh: 0.196\n",
      t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w(), image, map.resolution, map.x, map.y);
}

}  // namespace ipl_slam
