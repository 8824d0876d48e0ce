#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "dataset/association.hpp"
#include "dataset/trajectory.hpp"
#include "evaluation/statistics.hpp"

namespace ipl_slam {

/// An estimated pose and the ground truth it was compared with; positions in the ground truth's frame,
/// metres.
struct AlignedPair {
  double timestamp = 0.0;  ///< of the estimate, seconds
  Eigen::Vector3d truth;
  Eigen::Vector3d estimate;  ///< after the alignment
  [[nodiscard]] double error() const { return (estimate - truth).norm(); }
};

/// Absolute trajectory error (ATE), metres.
struct AteResult {
  std::size_t pairs = 0;  ///< poses of the estimate that have ground truth
  double rmse = 0.0, mean = 0.0, median = 0.0, std = 0.0, min = 0.0, max = 0.0;
  std::size_t estimated_poses = 0;     ///< of the trajectory as a whole
  std::size_t ground_truth_poses = 0;  ///< of the ground truth as a whole
  /// Share of the ground truth's time for which there are poses, 0 to 1. What lies between two poses counts
  /// unless it is longer than kMaxGap times the usual interval: there, tracking was lost. Ground truth that
  /// starts before or ends after the images keeps this below 1.
  double coverage = 0.0;
  SE3 T_ge;                          ///< the alignment: estimate's world into the ground truth's
  std::vector<AlignedPair> aligned;  ///< in order of time

  /// A time between two poses longer than this many median intervals is a gap.
  static constexpr double kMaxGap = 5.0;
};

/// Absolute trajectory error as the TUM RGB-D benchmark defines it (Sturm et al., IROS 2012): poses
/// associated by time, the estimate moved by the rigid motion that leaves the least squared distances (no
/// scale; Umeyama, PAMI 1991), statistics of the distances that remain. Throws UserError when fewer than 3
/// poses can be associated (with both ranges of time).
[[nodiscard]] AteResult absolute_trajectory_error(const Trajectory& ground_truth, const Trajectory& estimate,
                                                  double max_difference = kAssociationWindow);

}  // namespace ipl_slam
