#pragma once

#include <optional>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/camera.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {

/// Infinite line in space, in Pluecker coordinates: unit direction d and moment n = p x d, p being any point
/// of the line. n is normal to the plane through the line and the origin, and |n| is the line's distance from
/// the origin (metres).
struct Line3 {
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();

  /// Through a, then b. Nothing where the two are nearer than a micrometre: they have no direction.
  [[nodiscard]] static std::optional<Line3> through(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

  /// The point of the line that is nearest to the origin.
  [[nodiscard]] Eigen::Vector3d nearest_to_origin() const { return direction.cross(moment); }
  /// The point of the line that is nearest to p.
  [[nodiscard]] Eigen::Vector3d nearest_to(const Eigen::Vector3d& p) const {
    return nearest_to_origin() + direction.dot(p) * direction;
  }
  /// Distance of p from the line, m.
  [[nodiscard]] double distance(const Eigen::Vector3d& p) const {
    return (p.cross(direction) - moment).norm();
  }
};

/// The same line in frame a, for T_ab and a line of frame b.
[[nodiscard]] Line3 operator*(const SE3& T_ab, const Line3& line_b);

/// A line that passes the camera centre by less than this shows as a point: it has no image line and no
/// residual, metres.
inline constexpr double kMinLineDistance = 1e-4;

/// A line in the (undistorted) image: a u + b v + c = 0 with a^2 + b^2 = 1, so that a u + b v + c is the
/// signed distance of (u, v), pixels.
using ImageLine = Eigen::Vector3d;

/// Where a line of the camera frame shows in the image. Its normal (a, b) is its direction turned by a
/// quarter from the u- towards the v-axis: a line that runs to the right (+u) has positive distances below
/// it (+v). Nothing where the line passes the camera centre by less than kMinLineDistance, nor for a line in
/// the plane through the camera centre parallel to the image plane, whose image lies at infinity.
[[nodiscard]] std::optional<ImageLine> project_line(const Camera& camera, const Line3& line_c);

/// Image line through two undistorted pixels, with the same convention for the normal. Nothing where they are
/// nearer than 1e-6 pixel.
[[nodiscard]] std::optional<ImageLine> image_line(const Eigen::Vector2d& start, const Eigen::Vector2d& end);

/// Signed distance of an undistorted pixel, pixels.
[[nodiscard]] inline double signed_distance(const ImageLine& line, const Eigen::Vector2d& uv) {
  return line.head<2>().dot(uv) + line.z();
}

/// Inverse depth (1/m) of the point of a camera-frame line that shows at an undistorted pixel on, or very
/// near, its projection: 1/z = (r x d) . n / n^2 with r the ray of the pixel at z = 1. Zero or below where
/// the line is parallel to the ray or passes behind the camera there, zero where it passes the camera centre
/// by less than kMinLineDistance. Along the image of a line it is an affine function of the position.
[[nodiscard]] double inverse_depth_at(const Camera& camera, const Line3& line_c, const Eigen::Vector2d& uv);

}  // namespace ipl_slam
