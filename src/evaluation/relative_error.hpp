#pragma once

#include <cstddef>

#include "dataset/trajectory.hpp"
#include "evaluation/statistics.hpp"

namespace ipl_slam {

/// Over which distance in time the relative pose error looks.
struct RpeDelta {
  enum class Unit { kFrames, kSeconds };
  double length = 1.0;
  Unit unit = Unit::kSeconds;

  [[nodiscard]] static RpeDelta frames(double count) { return {count, Unit::kFrames}; }
  [[nodiscard]] static RpeDelta seconds(double duration) { return {duration, Unit::kSeconds}; }
};

/// Relative pose error (RPE): translation in metres, rotation in degrees, both per delta.
struct RpeResult {
  std::size_t pairs = 0;
  double trans_rmse = 0.0, trans_mean = 0.0, trans_median = 0.0, trans_std = 0.0, trans_min = 0.0,
         trans_max = 0.0;
  double rot_rmse = 0.0, rot_mean = 0.0, rot_median = 0.0, rot_std = 0.0, rot_min = 0.0, rot_max = 0.0;
};

/// Relative pose error with a fixed delta as the TUM RGB-D benchmark's script takes it (Sturm et al., IROS
/// 2012):
/// - each estimated pose i is paired with the pose j whose index or time is closest to i's plus delta, unless
/// j is
///   the trajectory's last pose (which stands for all times after the end);
/// - ground truth for i and j is the closest in time, the pair is left out where that is further away than
/// two median
///   intervals of the ground truth;
/// - error = (E_i^-1 E_j)^-1 (G_i^-1 G_j) up to inversion: the norm of its translation, the angle of its
/// rotation. All pairs are used (the script's --max_pairs 0). Throws UserError when fewer than 2 pairs
/// remain.
[[nodiscard]] RpeResult relative_pose_error(const Trajectory& ground_truth, const Trajectory& estimate,
                                            const RpeDelta& delta);

}  // namespace ipl_slam
