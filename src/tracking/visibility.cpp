#include "tracking/visibility.hpp"

namespace ipl_slam {

Visibility::Visibility(const Camera& camera, const ScalePyramid& pyramid)
    : camera_(camera), pyramid_(pyramid), slack_(pyramid.levels() > 1 ? pyramid.scale(1) : 1.2) {
  // The undistorted image bulges or shrinks most at corners and edge centres.
  const double w = camera.width - 1, h = camera.height - 1;
  min_uv_ = max_uv_ = camera.undistort({0.0, 0.0});
  for (const double x : {0.0, 0.5 * w, w}) {
    for (const double y : {0.0, 0.5 * h, h}) {
      const Eigen::Vector2d uv = camera.undistort({x, y});
      min_uv_ = min_uv_.cwiseMin(uv);
      max_uv_ = max_uv_.cwiseMax(uv);
    }
  }
}

}  // namespace ipl_slam
