#pragma once

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "evaluation/benchmark_record.hpp"
#include "evaluation/published_figures.hpp"
#include "evaluation/table.hpp"

namespace ipl_slam {

/// A sequence of a benchmark.
struct BenchmarkSequence {
  std::string name;
  const PublishedSequence* published = nullptr;  ///< null: not one of the paper's, or only a part of it
  std::string problem;                           ///< why it could not be run at all; mostly empty
};

/// The configurations that make the columns of Table 3 for one preset, in the order of ablation_titles().
struct AblationRow {
  std::string preset;
  std::array<std::string, 4> configurations;
};

/// All that the tables are made from.
struct BenchmarkResults {
  std::vector<BenchmarkSequence> sequences;
  std::vector<std::string> configurations;                      ///< those shown beside the published systems
  std::vector<AblationRow> ablation;                            ///< empty: no Table 3
  std::optional<std::pair<std::string, std::string>> compared;  ///< two configurations, tested for difference
  std::vector<BenchmarkRecord> records;
};

/// With a smaller share of a sequence's frames tracked in any run, its error is marked and never bold: it
/// says nothing of what was left out, which is mostly the hard part.
inline constexpr double kFullyTracked = 0.95;

/// Table 1: ATE statistics of every sequence, beside what was published. Bold: better than the best
/// published.
[[nodiscard]] Table ate_table(const BenchmarkResults& results);
/// Table 2: ATE RMSE beside all published systems, for the paper's sequences.
[[nodiscard]] Table systems_table(const BenchmarkResults& results);
/// Table 3: what lines, motion checks and weights add.
[[nodiscard]] Table ablation_table(const BenchmarkResults& results);
/// Table 4: times of the stages.
[[nodiscard]] Table times_table(const BenchmarkResults& results);
/// Relative pose errors over a frame and a second.
[[nodiscard]] Table relative_error_table(const BenchmarkResults& results);
/// How many runs there are, how much of each sequence was tracked, and what failed and why.
[[nodiscard]] Table runs_table(const BenchmarkResults& results);
/// Paired tests on the ATE RMSE of the two compared configurations: each sequence, and all together.
[[nodiscard]] Table comparison_table(const BenchmarkResults& results);

/// All of these for which there is something to show.
[[nodiscard]] std::vector<Table> benchmark_tables(const BenchmarkResults& results);

}  // namespace ipl_slam
