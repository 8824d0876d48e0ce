#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "evaluation/absolute_error.hpp"
#include "evaluation/relative_error.hpp"

namespace ipl_slam {

/// All figures of one trajectory.
struct Evaluation {
  std::string name;  ///< of the trajectory, e.g. its file
  AteResult ate;
  std::optional<RpeResult> rpe_frame;   ///< over 1 frame; absent for a trajectory too short for it
  std::optional<RpeResult> rpe_second;  ///< over 1 s; absent for a trajectory too short for it
};

/// Throws UserError when fewer than 3 poses can be associated; a relative error that cannot be taken is left
/// empty.
[[nodiscard]] Evaluation evaluate(const Trajectory& ground_truth, const Trajectory& estimate,
                                  const std::string& name, double max_difference = kAssociationWindow);

/// Tables for people, ending in a newline. One trajectory: a row per kind of error, a column per statistic.
/// Several: a row each, and "mean" and "± std" over all of them below.
[[nodiscard]] std::string evaluation_table(const std::vector<Evaluation>& evaluations);

/// {"trajectories": [{"name", "ate": {...}, "rpe_frame": {...} or null, "rpe_second"}], and for more than one
/// "summary":
/// {"ate_rmse": {"mean", "std", ...}, ...}}. Metres and degrees.
[[nodiscard]] nlohmann::ordered_json evaluation_json(const std::vector<Evaluation>& evaluations);

/// One trajectory's part of evaluation_json, for a run's summary.
[[nodiscard]] nlohmann::ordered_json evaluation_json(const Evaluation& evaluation);

}  // namespace ipl_slam
