#pragma once

#include <string>

#include <opencv2/core.hpp>

#include "common/options.hpp"
#include "dense/occupancy_grid.hpp"

namespace ipl_slam {

struct OccupancyMapOptions {
  double low = 0.1;   ///< m
  double high = 1.8;  ///< m

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("low", low, {-100.0, 100.0, "m", "what is lower over the floor is no obstacle"});
    v.number("high", high, {-100.0, 100.0, "m", "what is higher over the floor is no obstacle"});
  }
};

/// A floor plan as ROS's map_server reads it.
struct OccupancyMap {
  static constexpr int kOccupied = 0, kFree = 254, kUnknown = 205;

  cv::Mat image;            ///< CV_8UC1, the values above; row 0 has the greatest y
  double resolution = 0.0;  ///< m per pixel
  double x = 0.0, y = 0.0;  ///< lower left corner of the lower left pixel, m, in the grid's frame
  SE3 T_gw;                 ///< the grid's frame, in which the map lies, from the world
};

/// Seen along z of the grid's frame, which must be upright with the floor at 0 (Upright::T_uw): a pixel is
/// occupied where any cell between the two heights is, else free where any is. Throws UserError for a grid
/// with nothing between them, or so wide that the picture would have more than 100 million pixels.
[[nodiscard]] OccupancyMap occupancy_map(const OccupancyGrid& grid, const OccupancyMapOptions& options = {});

/// The picture: PGM (P5).
[[nodiscard]] std::string map_pgm(const OccupancyMap& map);
/// What map_server wants to know of it; image: the name of the picture's file. The transform from the world
/// of cloud and trajectory stands in a comment.
[[nodiscard]] std::string map_yaml(const OccupancyMap& map, const std::string& image);

}  // namespace ipl_slam
