#pragma once

#include <opencv2/core.hpp>

#include "dataset/trajectory.hpp"
#include "map/map.hpp"

namespace ipl_slam {

/// Picture of a map from above the first camera: points coloured by height, lines, keyframes as triangles
/// that open the way the camera looks, the camera's path as a line, axes in metres. CV_8UC3.
[[nodiscard]] cv::Mat draw_map_view(const Map& map, const Trajectory& path);

}  // namespace ipl_slam
