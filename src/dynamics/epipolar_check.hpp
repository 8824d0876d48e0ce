#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include <Eigen/Core>

#include "common/options.hpp"

namespace ipl_slam {

/// Settings of the epipolar check. The threshold is the paper's (about 1 px at 640x480); half of the pairs is
/// what a robust estimate can lose; 200 samples find 62 % of inliers with 99 %.
struct EpipolarCheckOptions {
  double threshold = 1.0;
  int min_pairs = 30;
  double min_agreement = 0.5;
  int max_samples = 200;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("threshold", threshold,
             {0.1, 20.0, "px", "a point further than this from its epipolar line is dynamic"});
    v.number("min_pairs", min_pairs, {8, 1000, "count", "pairs of static points the geometry needs"});
    v.number("min_agreement", min_agreement,
             {0.0, 1.0, "ratio", "share of the pairs that must agree on one epipolar geometry"});
    v.number("max_samples", max_samples, {1, 100000, "count", "random samples of eight pairs at most"});
  }
};

/// Undistorted pixels of one point in two frames.
struct PixelPair {
  Eigen::Vector2d before = Eigen::Vector2d::Zero();
  Eigen::Vector2d now = Eigen::Vector2d::Zero();
};

/// Distance D = |p'^T F p| / sqrt(l'_1^2 + l'_2^2) of p' from its epipolar line l' = F p, pixels. 0 where
/// there is no such line, nothing speaking against the point then: p is the epipole, or a number is not
/// finite.
[[nodiscard]] double epipolar_distance(const Eigen::Matrix3d& F, const PixelPair& pair);

/// F with now^T F before = 0 and Frobenius norm 1, from `pairs` by RANSAC, seeded (paper, section 3.4):
/// normalised eight-point algorithm (Hartley, "In defense of the eight-point algorithm", PAMI 1997) and
/// Sampson's distance. Pairs with a number that is not finite or that no image has are left out.
///
/// Nothing where the two views do not tell it: too few pairs or too few that agree, all points on a line, no
/// motion beyond the noise, or a homography that explains them as well (the camera only turned or hardly
/// moved, or all that is seen is one plane), since any of many F would do then. As well: its GRIC is not
/// larger (Torr, "Geometric motion segmentation and model selection", Phil. Trans. R. Soc. A 1998). GRIC
/// needs the noise of the pixels: that which `threshold` allows for, or that of what F leaves where it is
/// more.
[[nodiscard]] std::optional<Eigen::Matrix3d> fundamental_matrix(std::span<const PixelPair> pairs,
                                                                const EpipolarCheckOptions& options,
                                                                std::uint64_t seed);

}  // namespace ipl_slam
