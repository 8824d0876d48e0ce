#include "evaluation/relative_error.hpp"

#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

namespace ipl_slam {
namespace {

constexpr std::size_t kMinPairs = 2;

// Ground truth this many of its own median intervals away says nothing about a pose.
constexpr double kMaxIntervals = 2.0;

/// Index of the value closest to `target` in a non-empty increasing list. Of two equally close ones the
/// binary search's first is taken, as in the benchmark's script: with evenly spaced stamps such ties are
/// common, and any other choice would give other figures.
std::size_t closest(const std::vector<double>& values, double target) {
  std::size_t best = 0, begin = 0, end = values.size();
  double difference = std::abs(values.front() - target);
  while (begin < end) {
    const std::size_t middle = begin + (end - begin) / 2;
    if (std::abs(values[middle] - target) < difference) {
      best = middle;
      difference = std::abs(values[middle] - target);
    }
    if (values[middle] == target) return middle;
    if (values[middle] > target) {
      end = middle;
    } else {
      begin = middle + 1;
    }
  }
  return best;
}

std::vector<double> timestamps(const Trajectory& trajectory) {
  std::vector<double> stamps;
  for (const StampedPose& pose : trajectory) stamps.push_back(pose.timestamp);
  return stamps;
}

double median_interval(const std::vector<double>& stamps) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < stamps.size(); ++i) intervals.push_back(stamps[i] - stamps[i - 1]);
  return error_statistics(intervals).median;
}

/// What delta is counted in: the poses' numbers or their times.
std::vector<double> positions(const std::vector<double>& stamps, RpeDelta::Unit unit) {
  if (unit == RpeDelta::Unit::kSeconds) return stamps;
  std::vector<double> numbers(stamps.size());
  std::iota(numbers.begin(), numbers.end(), 0.0);
  return numbers;
}

RpeResult summarise(const std::vector<double>& translations, const std::vector<double>& rotations) {
  const Statistics t = error_statistics(translations), r = error_statistics(rotations);
  return {t.count, t.rmse, t.mean,   t.median, t.std, t.min, t.max,
          r.rmse,  r.mean, r.median, r.std,    r.min, r.max};
}

}  // namespace

RpeResult relative_pose_error(const Trajectory& ground_truth, const Trajectory& estimate,
                              const RpeDelta& delta) {
  std::vector<double> translations, rotations;
  if (!ground_truth.empty() && !estimate.empty()) {
    const std::vector<double> truth_times = timestamps(ground_truth), times = timestamps(estimate);
    const std::vector<double> places = positions(times, delta.unit);
    const double max_difference = kMaxIntervals * median_interval(truth_times);
    for (std::size_t i = 0; i < estimate.size(); ++i) {
      const std::size_t j = closest(places, places[i] + delta.length);
      if (j + 1 == estimate.size()) continue;
      const std::size_t gi = closest(truth_times, times[i]), gj = closest(truth_times, times[j]);
      if (std::abs(truth_times[gi] - times[i]) > max_difference) continue;
      if (std::abs(truth_times[gj] - times[j]) > max_difference) continue;
      const SE3 estimated = estimate[j].T_wc.inverse() * estimate[i].T_wc;
      const SE3 true_motion = ground_truth[gj].T_wc.inverse() * ground_truth[gi].T_wc;
      const SE3 error = estimated.inverse() * true_motion;
      translations.push_back(error.translation().norm());
      rotations.push_back(error.angle() * 180.0 / std::numbers::pi);
    }
  }
  if (translations.size() < kMinPairs) {
    throw UserError(
        fmt::format("only {} pairs of poses {} {} apart have ground truth, {} are needed; the trajectory is "
                    "too short or belongs to another sequence",
                    translations.size(), delta.length,
                    delta.unit == RpeDelta::Unit::kSeconds ? "s" : "frames", kMinPairs));
  }
  return summarise(translations, rotations);
}

}  // namespace ipl_slam
