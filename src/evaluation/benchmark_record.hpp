#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

namespace ipl_slam {

/// Which run of a benchmark a record is of, and what it was made from.
struct BenchmarkKey {
  std::string version;        ///< of the program
  std::string sequence;       ///< its folder, relative to that of all sequences
  std::string configuration;  ///< name of the settings
  int run = 0;                ///< 0, 1, ...
  std::string settings_hash;  ///< of every setting
  std::string sequence_hash;  ///< of its lists, ground truth and camera

  friend bool operator==(const BenchmarkKey&, const BenchmarkKey&) = default;
};

/// Figures of a trajectory; metres, degrees.
struct BenchmarkErrors {
  double ate_rmse = 0.0, ate_mean = 0.0, ate_median = 0.0, ate_std = 0.0;
  double coverage = 0.0;  ///< 0 to 1, see AteResult
  /// RMSE over one frame and over one second; absent for a trajectory too short for it.
  std::optional<double> frame_translation, frame_rotation, second_translation, second_rotation;
};

/// What a stage took: how often, and its mean in milliseconds.
struct StageTime {
  std::size_t count = 0;
  double mean = 0.0;
};

/// The result of one run.
struct BenchmarkRecord {
  BenchmarkKey key;
  std::string failure;  ///< why there is no result; empty for a run that ended well
  std::size_t frames = 0, tracked = 0, lost = 0, initializing = 0, skipped = 0;
  std::optional<BenchmarkErrors> errors;    ///< absent without ground truth
  std::map<std::string, StageTime> stages;  ///< by the names in summary.json's timing_ms

  [[nodiscard]] bool ok() const { return failure.empty(); }
};

/// The record's file: the run's summary (as in summary.json) with the key and "status" before it.
[[nodiscard]] nlohmann::ordered_json record_of_run(const BenchmarkKey& key,
                                                   const nlohmann::ordered_json& summary);
/// That of a run that failed.
[[nodiscard]] nlohmann::ordered_json record_of_failure(const BenchmarkKey& key, const std::string& reason);

/// Reads either. Nothing where the text is no such record, such as one of another version of the format.
[[nodiscard]] std::optional<BenchmarkRecord> parse_record(std::string_view text);

}  // namespace ipl_slam
