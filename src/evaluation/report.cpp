#include "evaluation/report.hpp"

#include <algorithm>
#include <array>
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

Row statistics_row(const std::string& name, std::size_t pairs, const std::array<double, 6>& figures,
                   int decimals) {
  Row row = {name, fmt::format("{}", pairs)};
  for (const double figure : figures) row.push_back(fmt::format("{:.{}f}", figure, decimals));
  return row;
}

void add_rpe_rows(std::vector<Row>& rows, const std::string& delta, const std::optional<RpeResult>& rpe) {
  if (!rpe) {
    rows.push_back({"RPE over " + delta, "0", "-", "-", "-", "-", "-", "-"});
    return;
  }
  const RpeResult& r = *rpe;
  rows.push_back(
      statistics_row(fmt::format("RPE over {} [m]", delta), r.pairs,
                     {r.trans_rmse, r.trans_mean, r.trans_median, r.trans_std, r.trans_min, r.trans_max}, 4));
  rows.push_back(statistics_row(fmt::format("RPE over {} [deg]", delta), r.pairs,
                                {r.rot_rmse, r.rot_mean, r.rot_median, r.rot_std, r.rot_min, r.rot_max}, 3));
}

/// One trajectory: a line per kind of error, a column per statistic.
std::string single_table(const Evaluation& evaluation) {
  const AteResult& a = evaluation.ate;
  std::vector<Row> rows = {{"", "pairs", "rmse", "mean", "median", "std", "min", "max"}};
  rows.push_back(statistics_row("ATE [m]", a.pairs, {a.rmse, a.mean, a.median, a.std, a.min, a.max}, 4));
  add_rpe_rows(rows, "1 frame", evaluation.rpe_frame);
  add_rpe_rows(rows, "1 s", evaluation.rpe_second);
  return fmt::format(
      "{}: {} of {} poses have ground truth, {:.1f} % of the ground truth's time is covered\n{}",
      evaluation.name, a.pairs, a.estimated_poses, 100.0 * a.coverage, format_rows(rows));
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
  Evaluation result;
  result.name = name;
  try {
    result.ate = absolute_trajectory_error(ground_truth, estimate, max_difference);
  } catch (const UserError& error) {  // of several trajectories, say which
    throw UserError(fmt::format("{}: {}", name, error.what()));
  }
  result.rpe_frame = try_relative_error(ground_truth, estimate, RpeDelta::frames(1.0));
  result.rpe_second = try_relative_error(ground_truth, estimate, RpeDelta::seconds(1.0));
  return result;
}

std::string evaluation_table(const std::vector<Evaluation>& evaluations) {
  if (evaluations.size() == 1) return single_table(evaluations.front());
  Row titles = {"trajectory", "pairs"}, units = {"", ""};
  for (const Figure& figure : figures()) {
    titles.emplace_back(figure.title);
    units.emplace_back(figure.unit);
  }
  std::vector<Row> rows = {titles, units};
  for (const Evaluation& evaluation : evaluations) rows.push_back(evaluation_row(evaluation));
  if (!evaluations.empty()) add_summary(rows, evaluations);
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
