#pragma once

#include <optional>

#include <Eigen/Core>

#include "common/options.hpp"
#include "dataset/trajectory.hpp"
#include "dense/semantic_cloud.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {

/// How upright_frame() tells where up is.
struct UprightOptions {
  double max_tilt = 45.0;       ///< degrees: as far from a wall that a camera tilted so far looks at
  double same_direction = 5.0;  ///< degrees
  double min_share = 0.05;      ///< of the points with normals
  double floor_share = 0.2;     ///< of the strongest level

  template <class Visitor>
  void visit(Visitor& v) {
    v.number(
        "max_tilt", max_tilt,
        {0.0, 60.0, "degree", "the normals of the floor are looked for so far from the cameras' mean up"});
    v.number(
        "same_direction", same_direction,
        {0.1, 20.0, "degree", "normals this near each other belong to the same or to parallel surfaces"});
    v.number(
        "min_share", min_share,
        {0.0, 1.0, "", "so many of the points must belong to level surfaces, or to walls, to be believed"});
    v.number("floor_share", floor_share,
             {0.0, 1.0, "", "the floor has at least this share of the points of the largest level surface"});
  }
};

/// The frame people think of a place in: z up, floor at height 0, axes along the walls.
struct Upright {
  SE3 T_uw;  ///< upright frame u from the world; turned about the world's origin, then raised
  bool level_was_found = false;  ///< up is the normal of level surfaces; else a mere guess
  /// The floor was found; else height 0 is that of the lowest points.
  bool floor_was_found = false;
  bool walls_were_found = false;  ///< x and y lie along walls; else x is where the first camera looks
};

/// Finds it from the cloud's normals. Up is first taken for the mean of the cameras' up, or `guess` (world)
/// without a trajectory; then for the mean of the normals that most points share near it: floors and table
/// tops. The floor is the lowest level that many of their points have and hardly a point lies under. Of the
/// four directions along the walls (Coughlan and Yuille, "Manhattan World", ICCV 1999), x is the one nearest
/// to where the first camera looks, or to `ahead` (world) without a trajectory.
[[nodiscard]] Upright upright_frame(const SemanticCloud& cloud, const Trajectory& trajectory,
                                    const UprightOptions& options = {},
                                    const Eigen::Vector3d& guess = -Eigen::Vector3d::UnitY(),
                                    const Eigen::Vector3d& ahead = Eigen::Vector3d::UnitZ());

}  // namespace ipl_slam
