#include "evaluation/report.hpp"

#include <algorithm>
#include <functional>
#include <iterator>

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

namespace ipl_slam {
namespace {

using Json = nlohmann::ordered_json;
using Getter = std::function<std::optional<double>(const Evaluation&)>;

/// A figure that is reported per trajectory and as mean and std over several.
struct Figure {
  const char* key;    ///< in the JSON summary
  const char* title;  ///< in the table
  const char* unit;
  int decimals;
  Getter value;
  double shown_as = 1.0;  ///< factor to the table's unit; JSON has the value itself
};

Getter of_frame(double RpeResult::*field) {
  return [field](const Evaluation& e) {
    return e.rpe_frame ? std::optional((*e.rpe_frame).*field) : std::nullopt;
  };
}

Getter of_second(double RpeResult::*field) {
  return [field](const Evaluation& e) {
    return e.rpe_second ? std::optional((*e.rpe_second).*field) : std::nullopt;
  };
}

Getter of_ate(double AteResult::*field) {
  return [field](const Evaluation& e) { return std::optional(e.ate.*field); };
}

const std::vector<Figure>& figures() {
  static const std::vector<Figure> all = {
      {"ate_rmse", "ATE rmse", "m", 4, of_ate(&AteResult::rmse)},
      {"ate_mean", "mean", "m", 4, of_ate(&AteResult::mean)},
      {"ate_median", "median", "m", 4, of_ate(&AteResult::median)},
      {"ate_std", "std", "m", 4, of_ate(&AteResult::std)},
      {"ate_min", "min", "m", 4, of_ate(&AteResult::min)},
      {"ate_max", "max", "m", 4, of_ate(&AteResult::max)},
      {"rpe_frame_trans_rmse", "RPE/frame", "m", 4, of_frame(&RpeResult::trans_rmse)},
      {"rpe_frame_rot_rmse", "RPE/frame", "deg", 3, of_frame(&RpeResult::rot_rmse)},
      {"rpe_second_trans_rmse", "RPE/s", "m", 4, of_second(&RpeResult::trans_rmse)},
      {"rpe_second_rot_rmse", "RPE/s", "deg", 3, of_second(&RpeResult::rot_rmse)},
      {"coverage", "coverage", "%", 1, of_ate(&AteResult::coverage), 100.0},
  };
  return all;
}

std::vector<double> values(const std::vector<Evaluation>& evaluations, const Figure& figure) {
  std::vector<double> result;
  for (const Evaluation& evaluation : evaluations) {
    if (const std::optional<double> value = figure.value(evaluation)) result.push_back(*value);
  }
  return result;
}

using Row = std::vector<std::string>;

std::string cell(const Figure& figure, const std::optional<double>& value) {
  return value ? fmt::format("{:.{}f}", *value * figure.shown_as, figure.decimals) : "-";
}

Row evaluation_row(const Evaluation& evaluation) {
  Row row = {evaluation.name, fmt::format("{}/{}", evaluation.ate.pairs, evaluation.ate.estimated_poses)};
  for (const Figure& figure : figures()) row.push_back(cell(figure, figure.value(evaluation)));
  return row;
}

/// Appends the rows "mean" and "± std" over all trajectories.
void add_summary(std::vector<Row>& rows, const std::vector<Evaluation>& evaluations) {
  Row mean = {fmt::format("mean of {}", evaluations.size()), ""}, deviation = {"± std", ""};
  for (const Figure& figure : figures()) {
    const Statistics runs = run_statistics(values(evaluations, figure));
    mean.push_back(cell(figure, runs.count > 0 ? std::optional(runs.mean) : std::nullopt));
    deviation.push_back(cell(figure, runs.count > 0 ? std::optional(runs.std) : std::nullopt));
  }
  rows.push_back(std::move(mean));
  rows.push_back(std::move(deviation));
}

/// Characters shown, which in UTF-8 are fewer than bytes.
std::size_t shown_width(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(
      text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

/// Columns as wide as their widest cell; the first one flush left, numbers flush right.
std::string format_rows(const std::vector<Row>& rows) {
  std::vector<std::size_t> widths(rows.front().size());
  for (const Row& row : rows) {
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], shown_width(row[c]));
  }
  std::string text;
  for (const Row& row : rows) {
    for (std::size_t c = 0; c < row.size(); ++c) {
      const std::string padding(widths[c] - shown_width(row[c]), ' ');
      text += c == 0 ? row[c] + padding : "  " + padding + row[c];
    }
    text += '\n';
  }
  return text;
}

Json rpe_json(const std::optional<RpeResult>& rpe) {
  if (!rpe) return nullptr;
  return {{"pairs", rpe->pairs},
          {"translation",
           {{"rmse", rpe->trans_rmse},
            {"mean", rpe->trans_mean},
            {"median", rpe->trans_median},
            {"std", rpe->trans_std},
            {"min", rpe->trans_min},
            {"max", rpe->trans_max}}},
          {"rotation_deg",
           {{"rmse", rpe->rot_rmse},
            {"mean", rpe->rot_mean},
            {"median", rpe->rot_median},
            {"std", rpe->rot_std},
            {"min", rpe->rot_min},
            {"max", rpe->rot_max}}}};
}

std::optional<RpeResult> try_relative_error(const Trajectory& ground_truth, const Trajectory& estimate,
                                            const RpeDelta& delta) {
  try {
    return relative_pose_error(ground_truth, estimate, delta);
  } catch (const UserError&) {  // too short for this delta: reported as absent
    return std::nullopt;
  }
}

}  // namespace

Evaluation evaluate(const Trajectory& ground_truth, const Trajectory& estimate, const std::string& name,
                    double max_difference) {
  return {name, absolute_trajectory_error(ground_truth, estimate, max_difference),
          try_relative_error(ground_truth, estimate, RpeDelta::frames(1.0)),
          try_relative_error(ground_truth, estimate, RpeDelta::seconds(1.0))};
}

std::string evaluation_table(const std::vector<Evaluation>& evaluations) {
  Row titles = {"trajectory", "pairs"}, units = {"", ""};
  for (const Figure& figure : figures()) {
    titles.emplace_back(figure.title);
    units.emplace_back(figure.unit);
  }
  std::vector<Row> rows = {titles, units};
  for (const Evaluation& evaluation : evaluations) rows.push_back(evaluation_row(evaluation));
  if (evaluations.size() > 1) add_summary(rows, evaluations);
  return format_rows(rows);
}

Json evaluation_json(const Evaluation& evaluation) {
  const AteResult& ate = evaluation.ate;
  const Eigen::Vector3d& t = ate.T_ge.translation();
  const Eigen::Quaterniond& q = ate.T_ge.rotation();
  Json json;
  json["name"] = evaluation.name;
  json["ate"] = {{"pairs", ate.pairs},
                 {"rmse", ate.rmse},
                 {"mean", ate.mean},
                 {"median", ate.median},
                 {"std", ate.std},
                 {"min", ate.min},
                 {"max", ate.max},
                 {"estimated_poses", ate.estimated_poses},
                 {"ground_truth_poses", ate.ground_truth_poses},
                 {"coverage", ate.coverage},
                 {"alignment", {{"t", {t.x(), t.y(), t.z()}}, {"q_xyzw", {q.x(), q.y(), q.z(), q.w()}}}}};
  json["rpe_frame"] = rpe_json(evaluation.rpe_frame);
  json["rpe_second"] = rpe_json(evaluation.rpe_second);
  return json;
}

Json evaluation_json(const std::vector<Evaluation>& evaluations) {
  Json json;
  json["trajectories"] = Json::array();
  for (const Evaluation& evaluation : evaluations)
    json["trajectories"].push_back(evaluation_json(evaluation));
  if (evaluations.size() < 2) return json;
  for (const Figure& figure : figures()) {
    const Statistics runs = run_statistics(values(evaluations, figure));
    json["summary"][figure.key] = runs.count == 0
                                      ? Json(nullptr)
                                      : Json{{"runs", runs.count},    {"mean", runs.mean}, {"std", runs.std},
                                             {"median", runs.median}, {"min", runs.min},   {"max", runs.max}};
  }
  return json;
}

}  // namespace ipl_slam
