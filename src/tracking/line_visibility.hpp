#pragma once

#include <optional>
#include <utility>

#include <Eigen/Core>

#include "geometry/camera.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {

/// The part of a straight piece between two points of the world that shows in the image: undistorted pixels,
/// cut at the near plane and at the borders. Nothing where no part shows.
[[nodiscard]] std::optional<std::pair<Eigen::Vector2d, Eigen::Vector2d>> visible_part(
    const Camera& camera, const SE3& T_cw, const Eigen::Vector3d& start_w, const Eigen::Vector3d& end_w);

}  // namespace ipl_slam
