#include "geometry/camera.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <ipl_slam/error.hpp>

namespace ipl_slam {
namespace {

constexpr int kNewtonSteps = 20;  // 3 or 4 are used in practice; the rest is for pixels far outside the image
constexpr int kMinImageSide = 16;
constexpr int kMaxImageSide = 8192;  // sums over the pixels of larger images would not fit their integers

// Distorted normalised image coordinates and their derivatives with respect to the undistorted ones.
struct Distortion {
  double x, y;
  double dx_dx, dx_dy, dy_dy;  // the Jacobian is symmetric: dy_dx = dx_dy
};

Distortion apply(const Camera& c, double x, double y) {
  const double xx = x * x, yy = y * y, xy = x * y, r2 = xx + yy;
  const double radial = 1.0 + r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3));
  const double slope = 2.0 * (c.k1 + r2 * (2.0 * c.k2 + r2 * 3.0 * c.k3));  // d radial / d x = slope * x
  return {x * radial + 2.0 * c.p1 * xy + c.p2 * (r2 + 2.0 * xx),
          y * radial + c.p1 * (r2 + 2.0 * yy) + 2.0 * c.p2 * xy,
          radial + slope * xx + 2.0 * c.p1 * y + 6.0 * c.p2 * x, slope * xy + 2.0 * c.p1 * x + 2.0 * c.p2 * y,
          radial + slope * yy + 6.0 * c.p1 * y + 2.0 * c.p2 * x};
}

void require(bool holds, const Camera& camera, const char* field, double value, const char* rule) {
  if (holds) return;
  throw UserError("camera '" + camera.name + "': " + field + " is " + std::to_string(value) +
                  ", but it must be " + rule);
}

}  // namespace

Eigen::Vector2d Camera::undistort(const Eigen::Vector2d& uv) const {
  if (!distorted()) return uv;
  const double xd = (uv.x() - cx) / fx, yd = (uv.y() - cy) / fy;
  const double tolerance =
      1e-8 / std::max(fx, fy);  // Newton's last step squares the error: far below 1e-6 pixel
  double x = xd, y = yd, step_x = 0.0, step_y = 0.0;
  double best = INFINITY;
  for (int i = 0; i < kNewtonSteps; ++i) {
    const Distortion d = apply(*this, x, y);
    const double ex = d.x - xd, ey = d.y - yd, error = std::abs(ex) + std::abs(ey);
    if (error < tolerance) break;
    if (!(error < best)) {  // overshot: go back half of the way
      step_x *= 0.5, step_y *= 0.5;
      x += step_x, y += step_y;
      continue;
    }
    best = error;
    const double det = d.dx_dx * d.dy_dy - d.dx_dy * d.dx_dy;
    if (!(std::abs(det) > 1e-12)) break;  // the model folds over here: there is no inverse to go to
    step_x = (d.dy_dy * ex - d.dx_dy * ey) / det;
    step_y = (d.dx_dx * ey - d.dx_dy * ex) / det;
    x -= step_x, y -= step_y;
  }
  return {fx * x + cx, fy * y + cy};
}

Eigen::Vector2d Camera::distort(const Eigen::Vector2d& uv) const {
  if (!distorted()) return uv;
  const Distortion d = apply(*this, (uv.x() - cx) / fx, (uv.y() - cy) / fy);
  return {fx * d.x + cx, fy * d.y + cy};
}

void Camera::check() const {
  const auto possible = [](int side) { return side >= kMinImageSide && side <= kMaxImageSide; };
  require(possible(width), *this, "width", width, "16 to 8192 pixels");
  require(possible(height), *this, "height", height, "16 to 8192 pixels");
  require(std::isfinite(fx) && fx > 0.0, *this, "fx", fx, "a focal length in pixels above 0");
  require(std::isfinite(fy) && fy > 0.0, *this, "fy", fy, "a focal length in pixels above 0");
  require(cx >= 0.0 && cx <= width, *this, "cx", cx, "inside the image's width");
  require(cy >= 0.0 && cy <= height, *this, "cy", cy, "inside the image's height");
  require(std::isfinite(k1), *this, "k1", k1, "a finite number");
  require(std::isfinite(k2), *this, "k2", k2, "a finite number");
  require(std::isfinite(p1), *this, "p1", p1, "a finite number");
  require(std::isfinite(p2), *this, "p2", p2, "a finite number");
  require(std::isfinite(k3), *this, "k3", k3, "a finite number");
  require(std::isfinite(depth_scale) && depth_scale > 0.0, *this, "depth_scale", depth_scale,
          "the raw depth units per metre, above 0");
}

}  // namespace ipl_slam
