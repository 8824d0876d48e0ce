#pragma once

#include <vector>

#include <Eigen/Core>

#include "geometry/camera.hpp"

namespace ipl_slam {

/// Camera::undistort for many pixels of the image at little cost: worked out once on a grid of 8 pixels and
/// interpolated. Off by at most 0.05 pixel, in the corners, for a lens as
/// strong as that of TUM freiburg1.
class UndistortionTable {
 public:
  explicit UndistortionTable(const Camera& camera);

  /// Pixels outside the image use its nearest cell.
  [[nodiscard]] Eigen::Vector2f operator()(const Eigen::Vector2f& pixel) const;

 private:
  bool distorted_;
  int columns_, rows_;  // of cells
  std::vector<Eigen::Vector2f> shifts_;
};

}  // namespace ipl_slam
