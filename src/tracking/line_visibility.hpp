#pragma once

#include <optional>
#include <utility>

#include <Eigen/Core>

#include "geometry/camera.hpp"
#include "geometry/se3.hpp"
#include "tracking/image_bounds.hpp"

namespace ipl_slam {

/// Decides which part of a straight piece of the world should show in an image.
class LineVisibility {
 public:
  explicit LineVisibility(const Camera& camera);

  /// The part between two points of the world that shows: undistorted pixels, in the order of the points, cut
  /// 5 cm before the camera and at the bounds of the undistorted image. Nothing where less than a pixel of it
  /// shows: it lies outside or behind, is seen end-on, or has no length.
  [[nodiscard]] std::optional<std::pair<Eigen::Vector2d, Eigen::Vector2d>> visible_part(
      const SE3& T_cw, const Eigen::Vector3d& start_w, const Eigen::Vector3d& end_w) const;

 private:
  Camera camera_;
  ImageBounds bounds_;
};

}  // namespace ipl_slam
