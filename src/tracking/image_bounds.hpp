#pragma once

#include <Eigen/Core>

#include "geometry/camera.hpp"

namespace ipl_slam {

/// What lies nearer to the camera than this is not looked for, m: no depth camera measures it.
inline constexpr double kNearPlane = 0.05;

/// The upright rectangle that holds every pixel of the image once the lens distortion is removed.
struct ImageBounds {
  Eigen::Vector2d min, max;  ///< undistorted pixels, both inside

  explicit ImageBounds(const Camera& camera);

  /// Whether an undistorted pixel lies in it.
  [[nodiscard]] bool contains(const Eigen::Vector2d& uv) const {
    return (uv.array() >= min.array()).all() && (uv.array() <= max.array()).all();
  }
};

}  // namespace ipl_slam
