#pragma once

#include <vector>

#include <Eigen/Core>

#include "geometry/camera.hpp"

namespace ipl_slam {

/// Camera::undistort for many pixels of the image at little cost: worked out once on a grid of 8 pixels and
/// interpolated. Off by less than 0.02 pixel for lenses as strong as those of the TUM cameras.
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
