#pragma once

#include <vector>

#include <Eigen/Core>

namespace ipl_slam::synthetic {

/// A closed way over the floor at walking pace: a uniform cubic B-spline about points set at equal distances
/// along a polygon. It is smooth (twice continuously differentiable in time), never leaves the polygon by
/// more than rounding its corners takes, and slows down in turns, as people do. Round after round is the
/// same.
class LoopPath {
 public:
  LoopPath() = default;
  /// corners of the polygon, metres; the last is joined to the first.
  explicit LoopPath(const std::vector<Eigen::Vector2d>& corners);

  /// Place at a time (seconds, may be negative).
  [[nodiscard]] Eigen::Vector2d position(double time) const;
  /// Unit vector of the direction of travel.
  [[nodiscard]] Eigen::Vector2d direction(double time) const;
  /// Seconds of one round.
  [[nodiscard]] double lap_time() const;
  /// The time of the first round at which the way is nearest to a place.
  [[nodiscard]] double nearest_time(const Eigen::Vector2d& place) const;

 private:
  std::vector<Eigen::Vector2d> knots_;
  double knot_time_ = 1.0;  // seconds from one to the next
};

}  // namespace ipl_slam::synthetic
