#include <algorithm>
#include <filesystem>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "common/atomic_file.hpp"
#include "common/log.hpp"
#include "dataset/trajectory.hpp"
#include "evaluation/report.hpp"
#include "evaluation/trajectory_plot.hpp"
#include "output.hpp"
#include "verbs.hpp"

namespace ipl_slam::cli {
namespace {

struct EvalArguments {
  std::string ground_truth;
  std::vector<std::string> trajectories;
  std::string json, plot;
  double max_difference = kAssociationWindow;
};

Trajectory read_and_report(const std::string& file) {
  std::size_t rejected = 0;
  Trajectory trajectory = read_trajectory(file, &rejected);
  if (rejected > 0) log().warn("{}", rejected_lines(file, rejected));
  return trajectory;
}

/// Of several runs, the one in the middle by its ATE stands for all.
std::size_t middle_run(const std::vector<Evaluation>& evaluations) {
  std::vector<std::size_t> order(evaluations.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return evaluations[a].ate.rmse < evaluations[b].ate.rmse;
  });
  return order[(order.size() - 1) / 2];
}

void run_eval(const EvalArguments& arguments) {
  const Trajectory ground_truth = read_and_report(arguments.ground_truth);
  const std::vector<std::string>& names = arguments.trajectories;
  std::vector<Trajectory> trajectories;
  std::vector<Evaluation> evaluations;
  for (std::size_t i = 0; i < names.size(); ++i) {
    trajectories.push_back(read_and_report(arguments.trajectories[i]));
    evaluations.push_back(evaluate(ground_truth, trajectories.back(), names[i], arguments.max_difference));
  }

  if (!arguments.plot.empty()) {
    const std::size_t shown = middle_run(evaluations);
    TrajectoryPlotStyle style;
    style.title = std::filesystem::path(names[shown]).filename().string();
    write_trajectory_plot(arguments.plot, ground_truth, trajectories[shown], evaluations[shown].ate, style);
  }
  const std::string json = json_text(evaluation_json(evaluations));
  if (arguments.json == "-") {
    fmt::print("{}", json);  // alone, so that another program can read it
    return;
  }
  if (!arguments.json.empty()) write_file_atomically(arguments.json, json);
  fmt::print("{}", evaluation_table(evaluations));
}

}  // namespace

void add_eval_verb(CLI::App& app) {
  CLI::App* verb = app.add_subcommand(
      "eval", "Compare trajectories with ground truth: ATE and RPE as the TUM benchmark defines them");
  const auto arguments = std::make_shared<EvalArguments>();
  verb->add_option("groundtruth", arguments->ground_truth, "Ground truth, TUM format")
      ->type_name("FILE")
      ->required();
  verb->add_option("trajectory", arguments->trajectories,
                   "Estimated trajectories, TUM format; several give mean and std")
      ->type_name("FILE")
      ->required();
  verb->add_option("--json", arguments->json,
                   "Write the figures as JSON to this file; - prints them instead of the table")
      ->type_name("FILE");
  verb->add_option("--plot", arguments->plot,
                   "Draw the trajectory (of several, the one with the median ATE) to this PNG")
      ->type_name("FILE");
  verb->add_option("--max-difference", arguments->max_difference,
                   "Poses further apart in time are not compared, s")
      ->type_name("SECONDS")
      ->check(CLI::Range(1e-9, 10.0))
      ->capture_default_str();
  verb->callback([arguments] { run_eval(*arguments); });
}

}  // namespace ipl_slam::cli
