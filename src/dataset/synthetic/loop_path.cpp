#include "dataset/synthetic/loop_path.hpp"

#include <array>
#include <cmath>

namespace ipl_slam::synthetic {
namespace {

using Eigen::Vector2d;

constexpr double kSpacing = 1.5;      // metres between the spline's points, about
constexpr double kSpeed = 0.9;        // m/s where the way is straight
constexpr double kSearchStep = 0.05;  // s

}  // namespace

LoopPath::LoopPath(const std::vector<Vector2d>& corners) {
  double length = 0.0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    length += (corners[(i + 1) % corners.size()] - corners[i]).norm();
  }
  const double count = std::round(length / kSpacing);
  const double spacing = length / count;
  knot_time_ = spacing / kSpeed;
  double next = 0.0;  // distance from the corner to the next point
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vector2d edge = corners[(i + 1) % corners.size()] - corners[i];
    for (; next < edge.norm() && static_cast<double>(knots_.size()) < count; next += spacing) {
      knots_.push_back(corners[i] + next * edge.normalized());
    }
    next -= edge.norm();
  }
}

Vector2d LoopPath::position(double time) const {
  const auto count = static_cast<long>(knots_.size());
  const double at = time / knot_time_;
  const auto first = static_cast<long>(std::floor(at));
  const double u = at - static_cast<double>(first);
  const double v = 1.0 - u;
  const std::array<double, 4> weights = {v * v * v / 6.0, (3.0 * u * u * u - 6.0 * u * u + 4.0) / 6.0,
                                         (3.0 * v * v * v - 6.0 * v * v + 4.0) / 6.0, u * u * u / 6.0};
  Vector2d sum(0, 0);
  for (long k = 0; k < 4; ++k) sum += weights[k] * knots_[((first + k) % count + count) % count];
  return sum;
}

Vector2d LoopPath::direction(double time) const {
  return (position(time + kSearchStep) - position(time - kSearchStep)).normalized();
}

double LoopPath::lap_time() const {
  return knot_time_ * static_cast<double>(knots_.size());
}

double LoopPath::nearest_time(const Vector2d& place) const {
  double best = 0.0;
  for (double time = 0.0; time < lap_time(); time += kSearchStep) {
    if ((position(time) - place).norm() < (position(best) - place).norm()) best = time;
  }
  return best;
}

}  // namespace ipl_slam::synthetic
