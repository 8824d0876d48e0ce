#include "tracking/image_bounds.hpp"

namespace ipl_slam {

ImageBounds::ImageBounds(const Camera& camera) {
  // The undistorted image bulges or shrinks most at corners and edge centres.
  const double w = camera.width - 1, h = camera.height - 1;
  min = max = camera.undistort({0.0, 0.0});
  for (const double x : {0.0, 0.5 * w, w}) {
    for (const double y : {0.0, 0.5 * h, h}) {
      const Eigen::Vector2d uv = camera.undistort({x, y});
      min = min.cwiseMin(uv);
      max = max.cwiseMax(uv);
    }
  }
}

}  // namespace ipl_slam
