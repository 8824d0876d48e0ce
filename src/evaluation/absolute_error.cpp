#include "evaluation/absolute_error.hpp"

#include <algorithm>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <ipl_slam/error.hpp>

namespace ipl_slam {
namespace {

// Two positions leave the rotation about the line through them open.
constexpr std::size_t kMinPairs = 3;

using IndexPairs = std::vector<std::pair<std::size_t, std::size_t>>;

std::vector<double> timestamps(const Trajectory& trajectory) {
  std::vector<double> stamps(trajectory.size());
  std::transform(trajectory.begin(), trajectory.end(), stamps.begin(),
                 [](const StampedPose& p) { return p.timestamp; });
  return stamps;
}

std::string time_range(const Trajectory& trajectory) {
  if (trajectory.empty()) return "no pose";
  return fmt::format("{:.6f} to {:.6f} s", trajectory.front().timestamp, trajectory.back().timestamp);
}

/// The rigid motion that takes the estimate's positions onto the ground truth's.
SE3 best_alignment(const Trajectory& ground_truth, const Trajectory& estimate, const IndexPairs& pairs) {
  Eigen::Matrix3Xd from(3, pairs.size()), to(3, pairs.size());
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    to.col(static_cast<Eigen::Index>(k)) = ground_truth[pairs[k].first].T_wc.translation();
    from.col(static_cast<Eigen::Index>(k)) = estimate[pairs[k].second].T_wc.translation();
  }
  const Eigen::Matrix4d T = Eigen::umeyama(from, to, false);
  return {Eigen::Matrix3d(T.topLeftCorner<3, 3>()), Eigen::Vector3d(T.topRightCorner<3, 1>())};
}

double covered_share(const Trajectory& ground_truth, const std::vector<AlignedPair>& aligned) {
  const double duration = ground_truth.back().timestamp - ground_truth.front().timestamp;
  if (!(duration > 0.0)) return 1.0;
  std::vector<double> intervals;
  for (std::size_t k = 1; k < aligned.size(); ++k) {
    intervals.push_back(aligned[k].timestamp - aligned[k - 1].timestamp);
  }
  const double longest = AteResult::kMaxGap * error_statistics(intervals).median;
  double covered = 0.0;
  for (const double interval : intervals) covered += interval <= longest ? interval : 0.0;
  return std::clamp(covered / duration, 0.0, 1.0);
}

}  // namespace

AteResult absolute_trajectory_error(const Trajectory& ground_truth, const Trajectory& estimate,
                                    double max_difference) {
  const IndexPairs pairs = associate(timestamps(ground_truth), timestamps(estimate), max_difference);
  if (pairs.size() < kMinPairs) {
    throw UserError(
        fmt::format("only {} poses of the trajectory have ground truth within {} s, {} are needed: the "
                    "ground truth covers {}, the "
                    "trajectory {}; check that both belong to the same sequence",
                    pairs.size(), max_difference, kMinPairs, time_range(ground_truth), time_range(estimate)));
  }

  AteResult result;
  result.T_ge = best_alignment(ground_truth, estimate, pairs);
  std::vector<double> errors;
  for (const auto& [truth, estimated] : pairs) {
    const StampedPose& pose = estimate[estimated];
    result.aligned.push_back(
        {pose.timestamp, ground_truth[truth].T_wc.translation(), result.T_ge * pose.T_wc.translation()});
    errors.push_back(result.aligned.back().error());
  }
  const Statistics statistics = error_statistics(errors);
  result.pairs = statistics.count;
  result.rmse = statistics.rmse;
  result.mean = statistics.mean;
  result.median = statistics.median;
  result.std = statistics.std;
  result.min = statistics.min;
  result.max = statistics.max;
  result.estimated_poses = estimate.size();
  result.ground_truth_poses = ground_truth.size();
  result.coverage = covered_share(ground_truth, result.aligned);
  return result;
}

}  // namespace ipl_slam
