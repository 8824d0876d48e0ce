#include "evaluation/benchmark_record.hpp"

namespace ipl_slam {
namespace {

using Json = nlohmann::ordered_json;

Json head(const BenchmarkKey& key, const char* status, const Json& reason) {
  return {{"version", key.version},
          {"sequence", key.sequence},
          {"configuration", key.configuration},
          {"run", key.run},
          {"settings_hash", key.settings_hash},
          {"sequence_hash", key.sequence_hash},
          {"status", status},
          {"reason", reason}};
}

BenchmarkErrors parse_errors(const Json& evaluation) {
  const Json& ate = evaluation.at("ate");
  BenchmarkErrors errors;
  errors.ate_rmse = ate.at("rmse");
  errors.ate_mean = ate.at("mean");
  errors.ate_median = ate.at("median");
  errors.ate_std = ate.at("std");
  errors.coverage = ate.at("coverage");
  if (const Json& rpe = evaluation.at("rpe_frame"); !rpe.is_null()) {
    errors.frame_translation = rpe.at("translation").at("rmse").get<double>();
    errors.frame_rotation = rpe.at("rotation_deg").at("rmse").get<double>();
  }
  if (const Json& rpe = evaluation.at("rpe_second"); !rpe.is_null()) {
    errors.second_translation = rpe.at("translation").at("rmse").get<double>();
    errors.second_rotation = rpe.at("rotation_deg").at("rmse").get<double>();
  }
  return errors;
}

void parse_result(const Json& json, BenchmarkRecord& record) {
  const Json& frames = json.at("frames");
  record.frames = frames.at("total");
  record.tracked = frames.at("tracked");
  record.lost = frames.at("lost");
  record.initializing = frames.at("initializing");
  record.skipped = frames.at("skipped").at("count");
  if (const Json& evaluation = json.at("evaluation"); !evaluation.is_null()) {
    record.errors = parse_errors(evaluation);
  }
  for (const auto& [stage, times] : json.at("timing_ms").items()) {
    if (!times.is_null()) record.stages[stage] = {times.at("count"), times.at("mean")};
  }
}

}  // namespace

Json record_of_run(const BenchmarkKey& key, const Json& summary) {
  Json record = head(key, "done", nullptr);
  for (const auto& [name, value] : summary.items()) {
    if (!record.contains(name)) record[name] = value;
  }
  return record;
}

Json record_of_failure(const BenchmarkKey& key, const std::string& reason) {
  return head(key, "failed", reason);
}

std::optional<BenchmarkRecord> parse_record(std::string_view text) {
  try {
    const Json json = Json::parse(text);
    BenchmarkRecord record;
    record.key = {json.at("version"), json.at("sequence"),      json.at("configuration"),
                  json.at("run"),     json.at("settings_hash"), json.at("sequence_hash")};
    if (json.at("status") == "done") {
      parse_result(json, record);
    } else {
      record.failure = json.at("reason").get<std::string>();
    }
    return record;
  } catch (const Json::exception&) {
    return std::nullopt;
  }
}

}  // namespace ipl_slam
