#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "common/cpu.hpp"
#include "common/options.hpp"
#include "features/feature_grid.hpp"
#include "features/features.hpp"

namespace ipl_slam {

/// Settings of the descriptor matchers.
struct MatchOptions {
  int max_distance = 80;      ///< differing bits of 256 at most
  double ratio = 0.8;         ///< best distance over second best must stay below this; 1 = no test
  double max_rotation = 0.5;  ///< orientation may differ from the expected one by this, rad; 0 = no check
  double inverse_depth_gate =
      0.1;  ///< inverse depth may differ from the predicted one by this, 1/m; 0 = no check

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("max_distance", max_distance, {0, 256, "bits", "descriptor distance a match may have"});
    v.number("ratio", ratio,
             {0.1, 1.0, "ratio", "best distance must be below this times the second best; 1 = no test"});
    v.number("max_rotation", max_rotation,
             {0.0, 3.2, "rad", "orientation may differ from the expected one by this; 0 = no check"});
    v.number("inverse_depth_gate", inverse_depth_gate,
             {0.0, 100.0, "1/m",
              "measured inverse depth may differ from the predicted one by this; 0 = no check"});
  }
};

/// A landmark as it is expected in the frame.
struct ProjectedPoint {
  Eigen::Vector2f uv = Eigen::Vector2f::Zero();  ///< undistorted pixel
  float radius = 0.0F;                           ///< of the search window, pixels
  int min_level = 0, max_level = 0;              ///< pyramid levels it may be found on, both included
  float depth = 0.0F;                            ///< predicted depth, m; 0 = do not check
  const Descriptor* descriptor = nullptr;        ///< not null
  float angle = -1.0F;  ///< expected orientation, rad in [0, 2 pi); < 0 = do not check
};

/// Finds each projected point among the keypoints around its pixel: the keypoint index per point, -1 where
/// there is none. A keypoint passes if its level fits, its orientation and measured depth (where it has one)
/// agree, and it is not taken. The closest descriptor wins if it is within max_distance and, where the second
/// best lies on the same level, clearly better than that: neighbouring levels often hold the same corner
/// twice, which is no ambiguity. Matches are one-to-one: of several points that chose one keypoint the
/// closest keeps it, the first among equals. `taken`, if not empty, has one entry per keypoint; those not 0
/// are left out.
[[nodiscard]] std::vector<int> match_projected(const Features& features, const FeatureGrid& grid,
                                               std::span<const ProjectedPoint> points,
                                               const MatchOptions& options,
                                               std::span<const std::uint8_t> taken = {});

/// Matches every keypoint of `a` with every one of `b`: pairs (index in a, index in b), ascending in a, that
/// are each other's closest, within max_distance and pass the ratio test in both directions. With
/// max_rotation > 0, pairs whose turn differs by more than that from the most frequent turn are dropped.
/// inverse_depth_gate is not used.
[[nodiscard]] std::vector<std::pair<int, int>> match_brute_force(const Features& a, const Features& b,
                                                                 const MatchOptions& options,
                                                                 Simd simd = best_simd());

}  // namespace ipl_slam
