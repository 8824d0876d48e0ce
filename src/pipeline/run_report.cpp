#include "pipeline/run_report.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <set>

#include <fmt/format.h>

#include <ipl_slam/version.hpp>

#include "common/process_info.hpp"
#include "pipeline/camera_json.hpp"

namespace ipl_slam {
namespace {

using Json = nlohmann::ordered_json;

// The value below which `share` of the sorted values lie (nearest rank).
double percentile(const std::vector<double>& sorted, double share) {
  const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(sorted.size())));
  return sorted[std::max<std::size_t>(rank, 1) - 1];
}

Json distribution(std::vector<double> values) {
  if (values.empty()) return nullptr;
  std::sort(values.begin(), values.end());
  const double sum = std::accumulate(values.begin(), values.end(), 0.0);
  return {{"count", values.size()},          {"mean", sum / static_cast<double>(values.size())},
          {"p50", percentile(values, 0.5)},  {"p90", percentile(values, 0.9)},
          {"p99", percentile(values, 0.99)}, {"max", values.back()}};
}

// Over all frames.
template <class Get>
Json stage_times(const SequenceRun& run, Get get) {
  std::vector<double> values;
  for (const FrameRecord& f : run.frames) values.push_back(get(f));
  return distribution(std::move(values));
}

// Over the frames in which the step was taken.
Json stage_times(const SequenceRun& run, double FrameRecord::*time) {
  std::vector<double> values;
  for (const FrameRecord& f : run.frames) {
    if (f.*time > 0.0) values.push_back(f.*time);
  }
  return distribution(std::move(values));
}

// The ids that were given, and those of them that were found moving.
struct SeenIds {
  std::set<InstanceId> all, moving;
};

SeenIds seen_ids(const SequenceRun& run, const DynamicSpans& dynamic) {
  SeenIds seen;
  for (const FrameRecord& f : run.frames) {
    for (const InstanceRecord& i : f.result.instances) {
      seen.all.insert(i.id);
      if (dynamic.contains(i.id, f.index)) seen.moving.insert(i.id);
    }
  }
  return seen;
}

// What the run saw of instances; null where nothing was segmented.
Json instances_json(const SequenceRun& run, const RunSetting& setting, const InstanceSchedule& instances) {
  const std::string segmenter = chosen_segmenter(setting.config.segmentation);
  if (segmenter == "none") return nullptr;
  const SeenIds seen = seen_ids(run, instances.dynamic());
  std::vector<double> ages;
  for (const FrameRecord& f : run.frames) {
    if (f.result.mask_age >= 0) ages.push_back(f.result.mask_age);
  }
  return {{"segmenter", segmenter},
          {"segmented_frames", instances.times().segmentation.size()},
          {"seen", seen.all.size()},
          {"moving", seen.moving.size()},
          {"mask_age_frames", distribution(std::move(ages))}};
}

Json timing_json(const SequenceRun& run, const InstanceTimes& instances) {
  return {{"load", stage_times(run, [](const FrameRecord& f) { return f.load; })},
          {"features", stage_times(run, [](const FrameRecord& f) { return f.result.times.features; })},
          {"instances", stage_times(run, [](const FrameRecord& f) { return f.result.times.instances; })},
          {"segmentation", distribution(instances.segmentation)},
          {"tracks", distribution(instances.tracks)},
          {"contours", distribution(instances.contours)},
          {"dynamics", stage_times(run, [](const FrameRecord& f) { return f.result.times.dynamics; })},
          {"tracking", stage_times(run, [](const FrameRecord& f) { return f.result.times.tracking; })},
          {"frame", stage_times(run,
                                [](const FrameRecord& f) {
                                  const FrameTimes& t = f.result.times;
                                  return t.features + t.instances + t.dynamics + t.tracking;
                                })},
          {"lines", stage_times(run, &FrameRecord::lines)},
          {"mapping", stage_times(run, &FrameRecord::mapping)}};
}

std::map<std::string, std::size_t> skips_by_reason(const SequenceRun& run) {
  std::map<std::string, std::size_t> counts;
  for (const SkippedFrame& s : run.skipped) ++counts[s.reason];
  return counts;
}

Json skips_json(const SequenceRun& run) {
  Json list = Json::array();
  for (const SkippedFrame& s : run.skipped) {
    list.push_back({{"timestamp", s.timestamp}, {"reason", s.reason}, {"detail", s.detail}});
  }
  return {{"count", run.skipped.size()}, {"reasons", skips_by_reason(run)}, {"frames", std::move(list)}};
}

Json map_json(const RunSetting& setting, const Pipeline& pipeline) {
  Json parts = Json::array();
  for (const TrajectoryPart& part : pipeline.trajectory_parts()) {
    if (!part.part.valid()) continue;
    parts.push_back({{"part", part.part.value},
                     {"loaded", part.part.value < setting.loaded_parts},
                     {"tracked", part.poses.size()}});
  }
  Json json;
  pipeline.mapping().read([&](const Map& map, const std::vector<MappingRecord>&) {
    json = {{"loaded", setting.loaded_map.empty() ? Json(nullptr) : Json(setting.loaded_map)},
            {"localize_only", setting.localize_only},
            {"keyframes", map.keyframes().size()},
            {"landmarks", map.points().size()},
            {"lines", map.lines().size()},
            {"parts", std::move(parts)}};
  });
  return json;
}

Json places_json(const std::vector<PlaceEvent>& events) {
  Json list = Json::array();
  for (const PlaceEvent& e : events) {
    Json json = {{"what", to_string(e.kind)},
                 {"frame", e.frame_index},
                 {"known_frame", e.known_index},
                 {"inliers", e.inliers}};
    if (e.kind == PlaceEvent::Kind::kLoop) {
      json["correction_m"] = e.translation;
      json["correction_deg"] = e.rotation * 180.0 / std::numbers::pi;
    }
    list.push_back(std::move(json));
  }
  return list;
}

// "loops closed: 2, parts joined: 1"; empty where no place was recognised.
std::string places_text(const std::vector<PlaceEvent>& events) {
  const auto count = [&](PlaceEvent::Kind kind) {
    return std::count_if(events.begin(), events.end(), [&](const PlaceEvent& e) { return e.kind == kind; });
  };
  std::vector<std::string> words;
  if (const auto n = count(PlaceEvent::Kind::kLoop)) words.push_back(fmt::format("loops closed: {}", n));
  if (const auto n = count(PlaceEvent::Kind::kMerge)) words.push_back(fmt::format("parts joined: {}", n));
  if (const auto n = count(PlaceEvent::Kind::kRelocalized)) {
    words.push_back(fmt::format("known places found while lost: {}", n));
  }
  return words.empty() ? "" : fmt::format("{}\n", fmt::join(words, ", "));
}

std::size_t labelled(const SemanticCloud& cloud) {
  return static_cast<std::size_t>(
      std::count_if(cloud.points.begin(), cloud.points.end(),
                    [](const CloudPoint& p) { return p.label != CloudPoint::kUnlabelled; }));
}

Json cloud_json(const DenseSchedule& schedule, const FusedRun& fused) {
  const DenseMap& dense = schedule.dense();
  const std::size_t kept = schedule.views().all().size();
  return {{"points", fused.result.cloud.points.size()},
          {"labelled", labelled(fused.result.cloud)},
          {"objects", fused.result.objects.size()},
          {"keyframes", dense.size()},
          {"keyframes_of_other_parts", kept - dense.size()},
          {"keyframes_dropped", schedule.dropped()},
          {"rebuilds", dense.rebuilds()},
          {"refused_blocks", dense.volume().refused()},
          {"volume_bytes", dense.volume().grid().bytes()},
          {"view_bytes", dense.views().bytes()},
          {"seconds", fused.seconds}};
}

// What the cloud holds, and what is not in it though it might have been.
std::string cloud_text(const DenseSchedule& schedule, const FusedRun& fused) {
  const DenseMap& dense = schedule.dense();
  std::string text =
      fmt::format("cloud of {} points, {} of them with a class, {} objects; volume {} MiB, {:.1f} s\n",
                  fused.result.cloud.points.size(), labelled(fused.result.cloud), fused.result.objects.size(),
                  dense.volume().grid().bytes() >> 20U, fused.seconds);
  if (const std::size_t others = schedule.views().all().size() - dense.size()) {
    text += fmt::format("  {} keyframes of other parts of the map are not in it\n", others);
  }
  if (schedule.dropped() > 0) {
    text += fmt::format("  {} keyframes are not in it: the machine was too slow\n", schedule.dropped());
  }
  if (dense.volume().refused() > 0) {
    text +=
        "  it is cut short at dense.volume.max_memory: raise that, or dense.volume.voxel and truncation\n";
  }
  return text;
}

double frames_per_second(const SequenceRun& run) {
  return run.seconds > 0.0 ? static_cast<double>(run.frames.size()) / run.seconds : 0.0;
}

}  // namespace

Json run_summary(const SequenceRun& run, const RunSetting& setting, const Pipeline& pipeline,
                 const Evaluation* evaluation, const FusedRun* fused) {
  const InstanceSchedule& instances = pipeline.instances();
  Config config = setting.config;
  return {{"version", kVersion},
          {"sequence", setting.sequence},
          {"preset", setting.preset},
          {"interrupted", run.interrupted},
          {"frames",
           {{"total", run.frames.size() + run.skipped.size()},
            {"processed", run.frames.size()},
            {"tracked", run.count(TrackingState::kTracking)},
            {"lost", run.count(TrackingState::kLost)},
            {"initializing", run.count(TrackingState::kInitializing)},
            {"skipped", skips_json(run)},
            {"unpaired_color", setting.unpaired_color}}},
          {"map", map_json(setting, pipeline)},
          {"places", places_json(pipeline.mapping().events())},
          {"cloud", fused ? cloud_json(*pipeline.dense(), *fused) : Json(nullptr)},
          {"instances", instances_json(run, setting, instances)},
          {"evaluation", evaluation ? evaluation_json(*evaluation) : Json(nullptr)},
          {"seconds", run.seconds},
          {"frames_per_second", frames_per_second(run)},
          {"timing_ms", timing_json(run, instances.times())},
          {"peak_memory_bytes", process_memory().peak},
          {"camera", camera_json(setting.camera)},
          {"config", options_json(option_table(config))}};
}

std::string timings_csv(const SequenceRun& run) {
  std::string csv =
      "frame,timestamp,state,keypoints,inliers,lines,keyframe,load_ms,features_ms,instances_ms,dynamics_ms,"
      "tracking_ms,"
      "lines_ms,mapping_ms\n";
  for (const FrameRecord& f : run.frames) {
    csv += fmt::format("{},{:.6f},{},{},{},{},{},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f}\n", f.index,
                       f.timestamp, to_string(f.result.state), f.result.keypoints, f.result.inliers,
                       f.result.lines, f.result.keyframe ? 1 : 0, f.load, f.result.times.features,
                       f.result.times.instances, f.result.times.dynamics, f.result.times.tracking, f.lines,
                       f.mapping);
  }
  return csv;
}

std::vector<std::string> skip_lines(const SequenceRun& run) {
  std::map<std::string, std::pair<std::size_t, std::string>> reasons;  // count and first detail
  for (const SkippedFrame& s : run.skipped) {
    auto& [count, detail] = reasons[s.reason];
    if (count++ == 0) detail = s.detail;
  }
  std::vector<std::string> lines;
  for (const auto& [reason, found] : reasons) {
    const auto& [count, detail] = found;
    lines.push_back(fmt::format("{} x {}", count, reason));
    if (!detail.empty()) lines.back() += (count > 1 ? ", e.g. " : ": ") + detail;
  }
  return lines;
}

std::string run_text(const SequenceRun& run, const Pipeline& pipeline, const FusedRun* fused) {
  std::string text;
  pipeline.mapping().read([&](const Map& map, const std::vector<MappingRecord>&) {
    text = fmt::format("{} frames: {} tracked, {} lost, {} skipped; {} keyframes, {} points, {} lines\n",
                       run.frames.size() + run.skipped.size(), run.count(TrackingState::kTracking),
                       run.count(TrackingState::kLost), run.skipped.size(), map.keyframes().size(),
                       map.points().size(), map.lines().size());
  });
  text += places_text(pipeline.mapping().events());
  const std::vector<TrajectoryPart> parts = pipeline.trajectory_parts();
  for (std::size_t i = 1; i < parts.size(); ++i) {
    text += fmt::format("  {} frames are in part {} of the map, which was not joined to the rest\n",
                        parts[i].poses.size(), parts[i].part.value);
  }
  if (const std::size_t waiting = run.count(TrackingState::kInitializing)) {
    text += fmt::format("  {} frames before a map could be started\n", waiting);
  }
  for (const std::string& line : skip_lines(run)) text += fmt::format("  {}\n", line);
  if (const SeenIds seen = seen_ids(run, pipeline.instances().dynamic()); !seen.all.empty()) {
    text += fmt::format("{} instances seen, {} of them moving\n", seen.all.size(), seen.moving.size());
  }
  if (fused) text += cloud_text(*pipeline.dense(), *fused);
  text += fmt::format("{:.1f} s, {:.1f} frames/s, peak memory {} MiB\n", run.seconds, frames_per_second(run),
                      process_memory().peak >> 20U);
  return text;
}

}  // namespace ipl_slam
