#include "pipeline/instance_log.hpp"

#include <cmath>

#include <nlohmann/json.hpp>

namespace ipl_slam {
namespace {

using Json = nlohmann::ordered_json;

// As many digits as say something.
double rounded(double value) {
  return std::round(value * 1e4) / 1e4;
}

Json instance_json(const InstanceRecord& record, std::size_t frame, const DynamicSpans& dynamic) {
  Json json = {{"id", record.id.value},
               {"class", record.class_name},
               {"score", rounded(record.score)},
               {"box", {record.box.x, record.box.y, record.box.width, record.box.height}},
               {"area", record.area},
               {"carried", record.frames_carried}};
  if (const auto& verdict = record.verdict) {
    json["similarity"] = verdict->similarity ? Json(rounded(*verdict->similarity)) : Json(nullptr);
    json["state"] = to_string(verdict->state);
    json["dynamic"] = verdict->state == MotionState::kMoving || dynamic.contains(record.id, frame);
  }
  if (const auto& region = record.region) {
    const RegionEvidence& e = region->evidence;
    json["removed"] = region->dynamic;
    json["belief"] = rounded(region->belief);
    json["moved_points"] = {e.moved_points, e.points};
    json["moved_lines"] = {e.moved_lines, e.lines};
  }
  if (record.removed.points + record.removed.lines > 0) {
    json["landmarks_removed"] = {{"points", record.removed.points}, {"lines", record.removed.lines}};
  }
  return json;
}

}  // namespace

std::string instances_line(std::size_t frame, double timestamp, int mask_age,
                           const std::vector<InstanceRecord>& instances, const DynamicSpans& dynamic) {
  Json list = Json::array();
  for (const InstanceRecord& record : instances) list.push_back(instance_json(record, frame, dynamic));
  const Json line = {{"frame", frame},
                     {"timestamp", timestamp},
                     {"mask_age", mask_age < 0 ? Json(nullptr) : Json(mask_age)},
                     {"instances", std::move(list)}};
  return line.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string instances_jsonl(const SequenceRun& run, const DynamicSpans& dynamic) {
  std::string lines;
  for (const FrameRecord& f : run.frames) {
    lines += instances_line(f.index, f.timestamp, f.result.mask_age, f.result.instances, dynamic);
  }
  return lines;
}

}  // namespace ipl_slam
