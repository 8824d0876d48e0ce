#pragma once

#include <opencv2/core.hpp>

#include "dataset/trajectory.hpp"
#include "map/map.hpp"

namespace ipl_slam {

/// Picture of a map from above the first camera: landmarks as dots (near its height dark, others pale),
/// keyframes as triangles, the camera's path as a line, a metre grid. CV_8UC3.
[[nodiscard]] cv::Mat draw_map_view(const Map& map, const Trajectory& path);

}  // namespace ipl_slam
