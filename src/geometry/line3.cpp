#include "geometry/line3.hpp"

namespace ipl_slam {
namespace {

constexpr double kMinExtent = 1e-6;  // m

}  // namespace

std::optional<Line3> Line3::through(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d along = b - a;
  const double length = along.norm();
  if (!(length > kMinExtent)) return std::nullopt;
  const Eigen::Vector3d direction = along / length;
  return Line3{a.cross(direction), direction};
}

Line3 operator*(const SE3& T_ab, const Line3& line_b) {
  const Eigen::Vector3d direction = T_ab.rotation() * line_b.direction;
  return {T_ab.rotation() * line_b.moment + T_ab.translation().cross(direction), direction};
}

std::optional<ImageLine> project_line(const Camera& camera, const Line3& line_c) {
  const Eigen::Vector3d& n = line_c.moment;
  if (!(n.norm() >= kMinLineDistance)) return std::nullopt;
  // l = K^-T n, times fx fy.
  const ImageLine l(
      camera.fy * n.x(), camera.fx * n.y(),
      camera.fx * camera.fy * n.z() - camera.fy * camera.cx * n.x() - camera.fx * camera.cy * n.y());
  const double norm = l.head<2>().norm();
  if (!(norm > 1e-12 * l.norm()))
    return std::nullopt;  // the horizon: parallel to the image plane, through the centre
  return ImageLine(l / norm);
}

std::optional<ImageLine> image_line(const Eigen::Vector2d& start, const Eigen::Vector2d& end) {
  const Eigen::Vector2d along = end - start;
  const double length = along.norm();
  if (!(length > 1e-6)) return std::nullopt;
  const Eigen::Vector2d normal(-along.y() / length, along.x() / length);
  return ImageLine(normal.x(), normal.y(), -normal.dot(start));
}

double inverse_depth_at(const Camera& camera, const Line3& line_c, const Eigen::Vector2d& uv) {
  if (!(line_c.moment.norm() >= kMinLineDistance)) return 0.0;
  const Eigen::Vector3d ray = camera.unproject(uv, 1.0);
  return ray.cross(line_c.direction).dot(line_c.moment) / line_c.moment.squaredNorm();
}

}  // namespace ipl_slam
