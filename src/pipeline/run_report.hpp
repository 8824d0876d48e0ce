#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "evaluation/report.hpp"
#include "pipeline/sequence_run.hpp"

namespace ipl_slam {

/// What a run was made from, for its summary.
struct RunSetting {
  std::string sequence;
  std::string preset;
  Camera camera;
  Config config;
  std::size_t unpaired_color = 0;  ///< colour images that were left out for want of a depth image
  std::string loaded_map = {};     ///< the file the run went on with; empty = none
  std::uint32_t loaded_parts = 0;  ///< parts of the map with ids below this are from there
  bool localize_only = false;
};

/// The cloud of a run.
struct FusedRun {
  DenseMap::Result result;
  double seconds = 0.0;  ///< it took at the end
};

/// The content of summary.json (docs/formats.md). Null: there is none.
[[nodiscard]] nlohmann::ordered_json run_summary(const SequenceRun& run, const RunSetting& setting,
                                                 const Pipeline& pipeline, const Evaluation* evaluation,
                                                 const FusedRun* fused = nullptr);
/// The content of timings.csv: one line per processed frame, times in milliseconds.
[[nodiscard]] std::string timings_csv(const SequenceRun& run);
/// "2 x missing color image, e.g. room/rgb/3.png: no such file": a line per reason; empty if none was
/// skipped.
[[nodiscard]] std::vector<std::string> skip_lines(const SequenceRun& run);
/// The same summary in a few lines for the terminal.
[[nodiscard]] std::string run_text(const SequenceRun& run, const Pipeline& pipeline,
                                   const FusedRun* fused = nullptr);

}  // namespace ipl_slam
