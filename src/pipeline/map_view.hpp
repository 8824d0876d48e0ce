#pragma once

#include <opencv2/core.hpp>

#include "dataset/trajectory.hpp"
#include "map/map.hpp"

namespace ipl_slam {

/// Picture of a map from above the first camera: points coloured by height, lines, keyframes as triangles
/// that open the way the camera looks, the camera's path as a line, axes in metres. CV_8UC3. One part of the
/// map is shown, that of the path: others would lie over it at random. Where the path has none, all of the
/// map is.
[[nodiscard]] cv::Mat draw_map_view(const Map& map, const TrajectoryPart& path);

}  // namespace ipl_slam
