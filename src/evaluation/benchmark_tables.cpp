#include "evaluation/benchmark_tables.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "evaluation/significance.hpp"
#include "evaluation/statistics.hpp"

namespace ipl_slam {
namespace {

using Records = std::vector<const BenchmarkRecord*>;
using PublishedFigure = std::optional<double> (*)(const PublishedAte&);

constexpr const char* kOfThePaper = " (published)";
constexpr const char* kPartly = "†";

// A kind of error, in our runs and in what was published.
struct AteFigure {
  const char* title;
  double BenchmarkErrors::*ours;
  PublishedFigure published;
};

const std::array<AteFigure, 4> kAteFigures = {{
    {"RMSE", &BenchmarkErrors::ate_rmse, [](const PublishedAte& a) { return std::optional(a.rmse); }},
    {"Mean", &BenchmarkErrors::ate_mean, [](const PublishedAte& a) { return a.mean; }},
    {"Median", &BenchmarkErrors::ate_median, [](const PublishedAte& a) { return a.median; }},
    {"STD", &BenchmarkErrors::ate_std, [](const PublishedAte& a) { return a.std; }},
}};

Records runs_of(const BenchmarkResults& results, const std::string& sequence,
                const std::string& configuration) {
  Records found;
  for (const BenchmarkRecord& record : results.records) {
    if (record.key.sequence == sequence && record.key.configuration == configuration)
      found.push_back(&record);
  }
  return found;
}

template <class Get>
TableCell mean_cell(const Records& runs, Get figure) {
  std::vector<double> values;
  for (const BenchmarkRecord* run : runs) {
    if (const std::optional<double> value = figure(*run); run->ok() && value) values.push_back(*value);
  }
  const Statistics s = run_statistics(values);
  TableCell cell;
  if (s.count > 0) cell.value = s.mean;
  if (s.count > 1) cell.std = s.std;
  return cell;
}

double tracked_share(const BenchmarkRecord& run) {
  return run.frames == 0 ? 0.0 : static_cast<double>(run.tracked) / static_cast<double>(run.frames);
}

bool fully_tracked(const Records& runs) {
  return std::all_of(runs.begin(), runs.end(), [](const BenchmarkRecord* run) {
    return !run->ok() || tracked_share(*run) >= kFullyTracked;
  });
}

// An error over the runs: bold where it beats the best published one, marked where much was not tracked.
TableCell error_cell(const Records& runs, double BenchmarkErrors::*field,
                     const std::optional<double>& to_beat) {
  TableCell cell = mean_cell(runs, [field](const BenchmarkRecord& r) {
    return r.errors ? std::optional((*r.errors).*field) : std::nullopt;
  });
  if (!cell.value) return cell;
  if (!fully_tracked(runs)) {
    cell.text = kPartly;
  } else {
    cell.bold = to_beat && *cell.value < *to_beat;
  }
  return cell;
}

std::string partly_note() {
  return fmt::format("{} less than {:.0f} % of the frames were tracked in some run.", kPartly,
                     100.0 * kFullyTracked);
}

// "failed" where no run ended well, so that a gap in a table explains itself.
std::string gap(const BenchmarkSequence& sequence, const Records& runs) {
  if (!sequence.problem.empty()) return "not run";
  if (runs.empty()) return "";
  const bool any = std::any_of(runs.begin(), runs.end(), [](const BenchmarkRecord* r) { return r->ok(); });
  return any ? "no usable ground truth" : "failed";
}

TableRow ate_row(const BenchmarkSequence& sequence, const std::string& configuration, const Records& runs) {
  TableRow row{sequence.name, configuration, {}};
  for (const AteFigure& figure : kAteFigures) {
    const auto to_beat =
        sequence.published ? best_published(*sequence.published, figure.published) : std::nullopt;
    row.cells.push_back(error_cell(runs, figure.ours, to_beat));
  }
  if (!row.cells.front().value) row.cells.front().text = gap(sequence, runs);
  return row;
}

TableRow published_row(const std::string& sequence, const PublishedAte& ate) {
  TableRow row{sequence, ate.system + kOfThePaper, {}};
  for (const AteFigure& figure : kAteFigures) row.cells.push_back({figure.published(ate), {}, {}, false});
  return row;
}

// Every configuration there is, those of the ablation last.
std::vector<std::string> all_configurations(const BenchmarkResults& results) {
  std::vector<std::string> all = results.configurations;
  for (const AblationRow& row : results.ablation) {
    for (const std::string& name : row.configurations) {
      if (std::find(all.begin(), all.end(), name) == all.end()) all.push_back(name);
    }
  }
  return all;
}

// A row per sequence and configuration that has runs.
template <class AddCells>
void add_rows(Table& table, const BenchmarkResults& results, AddCells cells) {
  for (const BenchmarkSequence& sequence : results.sequences) {
    for (const std::string& configuration : results.configurations) {
      const Records runs = runs_of(results, sequence.name, configuration);
      if (!runs.empty()) table.rows.push_back({sequence.name, configuration, cells(runs)});
    }
  }
}

template <class Get>
auto of_errors(Get get) {
  return [get](const BenchmarkRecord& r) -> std::optional<double> {
    return r.errors ? get(*r.errors) : std::nullopt;
  };
}

auto of_stage(const char* stage) {
  return [stage](const BenchmarkRecord& r) -> std::optional<double> {
    const auto found = r.stages.find(stage);
    return found == r.stages.end() ? std::nullopt : std::optional(found->second.mean);
  };
}

// Points of every frame, and the lines of keyframes spread over all frames.
std::optional<double> features_per_frame(const BenchmarkRecord& r) {
  const auto points = r.stages.find("features"), lines = r.stages.find("lines");
  if (points == r.stages.end()) return std::nullopt;
  double milliseconds = points->second.mean;
  if (lines != r.stages.end()) {
    milliseconds += lines->second.mean * static_cast<double>(lines->second.count) /
                    static_cast<double>(points->second.count);
  }
  return milliseconds;
}

std::vector<std::string> failures_of(const Records& runs) {
  std::vector<std::string> reasons;
  for (const BenchmarkRecord* run : runs) {
    if (!run->ok() && std::find(reasons.begin(), reasons.end(), run->failure) == reasons.end())
      reasons.push_back(run->failure);
  }
  return reasons;
}

TableCell words(std::string text) {
  return {std::nullopt, std::nullopt, std::move(text), false};
}

TableCell plain(double value) {
  return {value, std::nullopt, {}, false};
}

// Without the spread, which hardly matters here.
template <class Get>
TableCell plain_mean(const Records& runs, Get figure) {
  return {mean_cell(runs, figure).value, std::nullopt, {}, false};
}

std::vector<TableCell> runs_cells(const Records& runs) {
  const auto good = static_cast<std::size_t>(
      std::count_if(runs.begin(), runs.end(), [](const BenchmarkRecord* r) { return r->ok(); }));
  const auto count = [&](std::size_t BenchmarkRecord::*field) {
    return plain_mean(
        runs, [field](const BenchmarkRecord& r) { return std::optional(static_cast<double>(r.*field)); });
  };
  return {
      words(fmt::format("{} of {}", good, runs.size())),
      count(&BenchmarkRecord::frames),
      plain_mean(runs, [](const BenchmarkRecord& r) { return std::optional(100.0 * tracked_share(r)); }),
      count(&BenchmarkRecord::lost),
      count(&BenchmarkRecord::skipped),
      plain_mean(runs, of_errors([](const BenchmarkErrors& e) { return std::optional(100.0 * e.coverage); })),
      words(fmt::format("{}", fmt::join(failures_of(runs), "; ")))};
}

// ATE RMSE of two configurations on the same input.
struct Pairs {
  std::vector<double> a, b;

  [[nodiscard]] std::vector<double> differences() const {
    std::vector<double> result;
    for (std::size_t i = 0; i < a.size(); ++i) result.push_back(a[i] - b[i]);
    return result;
  }
  void add(const Pairs& more) {
    a.insert(a.end(), more.a.begin(), more.a.end());
    b.insert(b.end(), more.b.begin(), more.b.end());
  }
};

Pairs pairs_of(const BenchmarkResults& results, const std::string& sequence) {
  Pairs pairs;
  for (const BenchmarkRecord* a : runs_of(results, sequence, results.compared->first)) {
    for (const BenchmarkRecord* b : runs_of(results, sequence, results.compared->second)) {
      if (a->key.run != b->key.run || !a->errors || !b->errors) continue;
      pairs.a.push_back(a->errors->ate_rmse);
      pairs.b.push_back(b->errors->ate_rmse);
    }
  }
  return pairs;
}

TableRow test_row(const std::string& name, const Pairs& pairs) {
  const std::vector<double> differences = pairs.differences();
  TableRow row{name,
               {},
               {plain(static_cast<double>(differences.size())), plain(run_statistics(pairs.a).mean),
                plain(run_statistics(pairs.b).mean), plain(run_statistics(differences).mean)}};
  for (const auto& test : {paired_t_test(differences), wilcoxon_signed_rank(differences)}) {
    row.cells.push_back(test ? plain(test->statistic) : TableCell{});
    row.cells.push_back(test ? plain(test->p) : TableCell{});
  }
  return row;
}

}  // namespace

Table ate_table(const BenchmarkResults& results) {
  Table table{"1",
              "Table 1: absolute trajectory error (ATE)",
              "Ours: mean ± std over the runs. Bold: better than the best published figure of its kind. " +
                  partly_note(),
              {},
              {}};
  for (const AteFigure& figure : kAteFigures) table.columns.push_back({figure.title, "m", 4});
  for (const BenchmarkSequence& sequence : results.sequences) {
    if (sequence.published) {
      for (const PublishedAte& ate : sequence.published->ate) {
        if (ate.mean) table.rows.push_back(published_row(sequence.name, ate));
      }
    }
    for (const std::string& configuration : results.configurations) {
      const Records runs = runs_of(results, sequence.name, configuration);
      if (!runs.empty()) table.rows.push_back(ate_row(sequence, configuration, runs));
    }
    if (!sequence.problem.empty()) table.rows.push_back(ate_row(sequence, "", {}));
  }
  return table;
}

Table systems_table(const BenchmarkResults& results) {
  Table table{"2",
              "Table 2: ATE RMSE beside published systems",
              "Bold: ours, better than the best published. Figures of other systems as the IPL-SLAM paper "
              "gives them. " +
                  partly_note(),
              {},
              {}};
  for (const std::string& system : published_systems()) table.columns.push_back({system, "m", 4});
  for (const std::string& ours : results.configurations) table.columns.push_back({"ours: " + ours, "m", 4});
  for (const BenchmarkSequence& sequence : results.sequences) {
    if (!sequence.published) continue;
    TableRow row{sequence.name, {}, {}};
    for (const std::string& system : published_systems()) {
      const auto& ate = sequence.published->ate;
      const auto found =
          std::find_if(ate.begin(), ate.end(), [&](const PublishedAte& a) { return a.system == system; });
      row.cells.push_back(found == ate.end() ? TableCell{} : plain(found->rmse));
    }
    const AteFigure& rmse = kAteFigures.front();
    for (const std::string& configuration : results.configurations) {
      const Records runs = runs_of(results, sequence.name, configuration);
      row.cells.push_back(error_cell(runs, rmse.ours, best_published(*sequence.published, rmse.published)));
      if (!row.cells.back().value) row.cells.back().text = gap(sequence, runs);
    }
    table.rows.push_back(std::move(row));
  }
  if (table.rows.empty()) table.note = "None of the sequences is, in full, one of the paper's.";
  return table;
}

Table ablation_table(const BenchmarkResults& results) {
  Table table{"3",
              "Table 3: ablation, ATE RMSE",
              "Each column is one configuration; the last is the preset as it is. " + partly_note(),
              {},
              {}};
  for (const std::string& title : ablation_titles()) table.columns.push_back({title, "m", 6});
  for (const BenchmarkSequence& sequence : results.sequences) {
    if (sequence.published && sequence.published->ablation) {
      TableRow row{sequence.name, std::string("IPL-SLAM") + kOfThePaper, {}};
      for (const double rmse : *sequence.published->ablation) row.cells.push_back(plain(rmse));
      table.rows.push_back(std::move(row));
    }
    for (const AblationRow& ablation : results.ablation) {
      TableRow row{sequence.name, ablation.preset, {}};
      for (const std::string& configuration : ablation.configurations) {
        const Records runs = runs_of(results, sequence.name, configuration);
        row.cells.push_back(error_cell(runs, &BenchmarkErrors::ate_rmse, std::nullopt));
        if (!row.cells.back().value) row.cells.back().text = gap(sequence, runs);
      }
      table.rows.push_back(std::move(row));
    }
  }
  return table;
}

Table times_table(const BenchmarkResults& results) {
  Table table{
      "4",
      "Table 4: time per frame",
      "Wall-clock milliseconds, mean of the runs' means. Points: every frame. Lines, mapping: per "
      "keyframe. Points + lines: per frame, the lines' time spread over all frames. Segmentation: per "
      "image segmented. Tracking thread: what a frame waits for; in lockstep that includes "
      "segmentation, in realtime it does not. Published times are of an i7-8750H with a GTX 1050 Ti "
      "(DS-SLAM segments with SegNet, IPL-SLAM with YOLOv8, both on the graphics card); the paper "
      "gives 135 ms for IPL-SLAM's tracking thread.",
      {{"points", "ms", 2},
       {"lines", "ms", 2},
       {"points + lines", "ms", 2},
       {"segmentation", "ms", 2},
       {"pose", "ms", 2},
       {"tracking thread", "ms", 2},
       {"mapping", "ms", 2}},
      {}};
  for (const BenchmarkSequence& sequence : results.sequences) {
    if (sequence.published) {
      for (const PublishedTimes& times : sequence.published->times) {
        table.rows.push_back({sequence.name,
                              times.system + kOfThePaper,
                              {{}, {}, plain(times.features), plain(times.segmentation), {}, {}, {}}});
      }
    }
    for (const std::string& configuration : results.configurations) {
      const Records runs = runs_of(results, sequence.name, configuration);
      if (std::none_of(runs.begin(), runs.end(), [](const BenchmarkRecord* r) { return r->ok(); })) continue;
      table.rows.push_back({sequence.name,
                            configuration,
                            {mean_cell(runs, of_stage("features")), mean_cell(runs, of_stage("lines")),
                             mean_cell(runs, features_per_frame), mean_cell(runs, of_stage("segmentation")),
                             mean_cell(runs, of_stage("tracking")), mean_cell(runs, of_stage("frame")),
                             mean_cell(runs, of_stage("mapping"))}});
    }
  }
  return table;
}

Table relative_error_table(const BenchmarkResults& results) {
  Table table{"rpe",
              "Relative pose error (RPE), RMSE",
              partly_note(),
              {{"translation, 1 frame", "m", 4},
               {"rotation, 1 frame", "deg", 3},
               {"translation, 1 s", "m", 4},
               {"rotation, 1 s", "deg", 3}},
              {}};
  add_rows(table, results, [](const Records& runs) {
    std::vector<TableCell> cells;
    for (const auto field : {&BenchmarkErrors::frame_translation, &BenchmarkErrors::frame_rotation,
                             &BenchmarkErrors::second_translation, &BenchmarkErrors::second_rotation}) {
      cells.push_back(mean_cell(runs, of_errors([field](const BenchmarkErrors& e) { return e.*field; })));
      if (cells.back().value && !fully_tracked(runs)) cells.back().text = kPartly;
    }
    return cells;
  });
  return table;
}

Table runs_table(const BenchmarkResults& results) {
  Table table{"runs",
              "Runs",
              "Means over the runs that ended well. Coverage: share of the ground truth's time with poses.",
              {{"done", "", 0},
               {"frames", "", 1},
               {"tracked", "%", 1},
               {"lost", "frames", 1},
               {"skipped", "frames", 1},
               {"coverage", "%", 1},
               {"reason of failure", "", 0}},
              {}};
  for (const BenchmarkSequence& sequence : results.sequences) {
    if (!sequence.problem.empty()) {
      table.rows.push_back(
          {sequence.name, "", {words("not run"), {}, {}, {}, {}, {}, words(sequence.problem)}});
    }
    for (const std::string& configuration : all_configurations(results)) {
      const Records runs = runs_of(results, sequence.name, configuration);
      if (!runs.empty()) table.rows.push_back({sequence.name, configuration, runs_cells(runs)});
    }
  }
  return table;
}

Table comparison_table(const BenchmarkResults& results) {
  const auto& [a, b] = results.compared.value();
  Table table{
      "comparison",
      fmt::format("{} against {}: is the difference real?", a, b),
      fmt::format("ATE RMSE; pairs are the same run of the same sequence, the difference is {} minus {}. "
                  "p: two-sided, of the paired t test and of Wilcoxon's signed-rank test. Runs of one "
                  "sequence resemble each other, which makes the p over all pairs too small; the row of "
                  "means takes each sequence as one pair.",
                  a, b),
      {{"pairs", "", 0},
       {a, "m", 4},
       {b, "m", 4},
       {"difference", "m", 4},
       {"t", "", 2},
       {"p (t test)", "", TableColumn::kThreeDigits},
       {"W+", "", 1},
       {"p (Wilcoxon)", "", TableColumn::kThreeDigits}},
      {}};
  Pairs all, means;
  for (const BenchmarkSequence& sequence : results.sequences) {
    const Pairs pairs = pairs_of(results, sequence.name);
    if (pairs.a.empty()) continue;
    table.rows.push_back(test_row(sequence.name, pairs));
    all.add(pairs);
    means.add({{run_statistics(pairs.a).mean}, {run_statistics(pairs.b).mean}});
  }
  if (all.a.empty()) {
    table.note = "There is no pair: no run of the same sequence with both and with ground truth.";
    return table;
  }
  table.rows.push_back(test_row("all pairs", all));
  table.rows.push_back(test_row("means of the sequences", means));
  return table;
}

std::vector<Table> benchmark_tables(const BenchmarkResults& results) {
  std::vector<Table> tables = {ate_table(results), systems_table(results)};
  if (!results.ablation.empty()) tables.push_back(ablation_table(results));
  tables.push_back(times_table(results));
  tables.push_back(relative_error_table(results));
  if (results.compared) tables.push_back(comparison_table(results));
  tables.push_back(runs_table(results));
  return tables;
}

}  // namespace ipl_slam
