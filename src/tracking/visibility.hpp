#pragma once

#include <optional>

#include <Eigen/Core>

#include "features/matcher.hpp"
#include "features/scale_pyramid.hpp"
#include "geometry/camera.hpp"
#include "geometry/se3.hpp"
#include "tracking/image_bounds.hpp"

namespace ipl_slam {

/// Decides whether a landmark should show in an image, and where to look for it.
class Visibility {
 public:
  Visibility(const Camera& camera, const ScalePyramid& pyramid);

  /// The search window for a landmark (LocalPoint or Point) seen from T_cw: within the image, within the
  /// range of distances the pyramid covers, and from no more than 60 degrees off the direction it was seen
  /// from. `radius` is in pixels of the predicted pyramid level.
  template <class Landmark>
  [[nodiscard]] std::optional<ProjectedPoint> project(const SE3& T_cw, const Landmark& landmark,
                                                      double radius) const {
    const Eigen::Vector3d p_c = T_cw * landmark.position;
    if (p_c.z() <= kNearPlane) return std::nullopt;
    const Eigen::Vector2d uv = camera_.project(p_c);
    if (!inside(uv)) return std::nullopt;
    const double distance = p_c.norm();
    // The pyramid's range is widened by one level either way: the level found is uncertain by that much.
    if (distance > slack_ * landmark.max_distance || slack_ * distance < landmark.min_distance)
      return std::nullopt;
    const Eigen::Vector3d ray_w = T_cw.rotation().conjugate() * p_c;
    if (ray_w.dot(landmark.normal) < kMaxViewCosine * distance) return std::nullopt;
    const int level = pyramid_.predict_level(landmark.max_distance, distance);
    ProjectedPoint point{};
    point.uv = uv.cast<float>();
    point.radius = static_cast<float>(radius * pyramid_.scale(level));
    point.min_level = level - 1;
    point.max_level = level;
    point.depth = static_cast<float>(p_c.z());
    point.descriptor = &landmark.descriptor;
    point.angle = -1.0F;
    return point;
  }

  /// Whether an undistorted pixel lies in the image.
  [[nodiscard]] bool inside(const Eigen::Vector2d& uv) const { return bounds_.contains(uv); }

 private:
  static constexpr double kMaxViewCosine = 0.5;  // 60 degrees; a patch looks too different beyond

  Camera camera_;
  ScalePyramid pyramid_;
  double slack_;
  ImageBounds bounds_;
};

}  // namespace ipl_slam
