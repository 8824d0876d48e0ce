#pragma once

#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "features/line_features.hpp"

namespace ipl_slam {

/// A motion of the image: turn, scale and shift, x' = A x + t. What a camera's motion looks like where depth
/// does not vary much.
struct ImageMotion {
  Eigen::Matrix2d A = Eigen::Matrix2d::Identity();
  Eigen::Vector2d t = Eigen::Vector2d::Zero();

  [[nodiscard]] Eigen::Vector2f operator*(const Eigen::Vector2f& x) const {
    return (A * x.cast<double>() + t).cast<float>();
  }
};

/// The motion that most of the matched segments share, by random samples of two (seeded: the same input gives
/// the same result). A line tells of the motion only what lies across it: each pair asks that the end points
/// of a's segment come to lie on the line of b's, `threshold` pixels at most beside it. Where the pairs leave
/// something open (all lines parallel, for one), the smallest motion is taken. The identity for fewer than
/// two pairs, and where no two agree.
[[nodiscard]] ImageMotion common_motion(std::span<const LineSegment> a, std::span<const LineSegment> b,
                                        std::span<const std::pair<int, int>> pairs, double threshold);

}  // namespace ipl_slam
