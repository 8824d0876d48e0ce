#include "tracking/line_visibility.hpp"

#include <algorithm>

namespace ipl_slam {
namespace {

constexpr double kMinLength = 1.0;  // pixels; a shorter piece has no direction worth a name

// Part [from, to] of the way from a piece's start to its end.
struct Part {
  double from = 0.0, to = 1.0;

  // Keeps what has `start` + s (`end` - `start`) >= 0 (Liang and Barsky, "A new concept and method for line
  // clipping", ACM TOG 1984). Both are signed distances from a border, positive inside.
  void cut(double start, double end) {
    if (!(start >= 0.0 || end >= 0.0)) to = -1.0;  // also for numbers that are none
    if (start < 0.0) from = std::max(from, start / (start - end));
    if (end < 0.0) to = std::min(to, start / (start - end));
  }
  [[nodiscard]] bool empty() const { return !(from <= to); }
};

// The points at both ends of a part.
template <class Point>
std::pair<Point, Point> ends(const Part& part, const Point& start, const Point& end) {
  const Point along = end - start;
  return {part.from > 0.0 ? Point(start + part.from * along) : start,
          part.to < 1.0 ? Point(start + part.to * along) : end};
}

}  // namespace

LineVisibility::LineVisibility(const Camera& camera) : camera_(camera), bounds_(camera) {}

std::optional<std::pair<Eigen::Vector2d, Eigen::Vector2d>> LineVisibility::visible_part(
    const SE3& T_cw, const Eigen::Vector3d& start_w, const Eigen::Vector3d& end_w) const {
  const Eigen::Vector3d start_c = T_cw * start_w, end_c = T_cw * end_w;
  Part in_front;
  in_front.cut(start_c.z() - kNearPlane, end_c.z() - kNearPlane);
  if (in_front.empty()) return std::nullopt;
  const auto [near_c, far_c] = ends(in_front, start_c, end_c);
  const Eigen::Vector2d start = camera_.project(near_c), end = camera_.project(far_c);

  Part inside;
  for (int axis = 0; axis < 2; ++axis) {
    inside.cut(start[axis] - bounds_.min[axis], end[axis] - bounds_.min[axis]);
    inside.cut(bounds_.max[axis] - start[axis], bounds_.max[axis] - end[axis]);
  }
  if (inside.empty()) return std::nullopt;
  const auto shown = ends(inside, start, end);
  if (!((shown.second - shown.first).norm() >= kMinLength)) return std::nullopt;
  return shown;
}

}  // namespace ipl_slam
