#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "common/options.hpp"

namespace ipl_slam {

struct EpipolarCheckOptions {
  double threshold = 1.0;
  int min_pairs = 30;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("threshold", threshold,
             {0.1, 20.0, "px", "a point further than this from its epipolar line is dynamic"});
    v.number("min_pairs", min_pairs, {8, 1000, "count", "pairs of static points the geometry needs"});
  }
};

/// Undistorted pixels of one point in two frames.
struct PixelPair {
  Eigen::Vector2d before = Eigen::Vector2d::Zero();
  Eigen::Vector2d now = Eigen::Vector2d::Zero();
};

/// Distance D = |p'^T F p| / sqrt(l'_1^2 + l'_2^2) of p' from its epipolar line l' = F p, pixels.
[[nodiscard]] double epipolar_distance(const Eigen::Matrix3d& F, const PixelPair& pair);

/// F with now^T F before = 0, from `pairs` by RANSAC, seeded (paper, section 3.4). Nothing where the two
/// views do not tell it: too few pairs, no motion beyond the noise, or a homography that explains them as
/// well (the camera only turned, or all that is seen is one plane), since any of many F would do then.
[[nodiscard]] std::optional<Eigen::Matrix3d> fundamental_matrix(std::span<const PixelPair> pairs,
                                                                const EpipolarCheckOptions& options,
                                                                std::uint64_t seed);

}  // namespace ipl_slam
