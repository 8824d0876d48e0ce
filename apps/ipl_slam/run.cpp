#include <exception>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

#include "cloud_outputs.hpp"
#include "common/atomic_file.hpp"
#include "common/interrupt.hpp"
#include "common/log.hpp"
#include "common/progress.hpp"
#include "common/stopwatch.hpp"
#include "dataset/trajectory.hpp"
#include "dense/keyframe_folder.hpp"
#include "evaluation/report.hpp"
#include "evaluation/trajectory_plot.hpp"
#include "frame_folder.hpp"
#include "map/map_file.hpp"
#include "output.hpp"
#include "pipeline/feature_overlay.hpp"
#include "pipeline/instance_log.hpp"
#include "pipeline/instance_overlay.hpp"
#include "pipeline/lines_ply.hpp"
#include "pipeline/loaded_map.hpp"
#include "pipeline/map_view.hpp"
#include "pipeline/run_report.hpp"
#include "pipeline/sequence_run.hpp"
#include "segmenter_choice.hpp"
#include "sequence_input.hpp"
#include "sequence_options.hpp"
#include "verbs.hpp"

namespace ipl_slam::cli {
namespace {

namespace fs = std::filesystem;

struct RunOptions {
  SequenceOptions sequence;
  fs::path output;
  SegmenterChoice segmenter;
  CloudOutputs cloud;
  bool save_keyframes = false;
  fs::path save_map, load_map;
  bool localize_only = false;
  bool realtime = false;
  bool save_overlays = false;
  int threads = 0;
};

// A place for the results, proven writable: better to fail now than after an hour of tracking.
class OutputFolder {
 public:
  explicit OutputFolder(fs::path folder) : folder_(std::move(folder)) {
    created_ = make_folder(folder_);
    check_writable(folder_ / "summary.json");
  }

  [[nodiscard]] fs::path operator/(const std::string& name) const { return folder_ / name; }
  [[nodiscard]] const fs::path& path() const { return folder_; }

  /// For a run that has nothing to write.
  void leave_no_trace() const {
    std::error_code ignored;
    if (created_) fs::remove(folder_, ignored);
  }
  /// Takes away what a run before this one left and this one may not replace. The summary goes too: it is
  /// written last, so where it is, everything beside it is of the same run.
  void make_way() const {
    std::error_code ignored;
    for (const char* name : {"summary.json", "trajectory.png", "instances.jsonl"})
      fs::remove(folder_ / name, ignored);
    CloudOutputs::clear(folder_);
    FrameFolder::clear(folder_ / "overlays");
    clear_keyframe_folder(folder_ / "keyframes");
  }

 private:
  fs::path folder_;
  bool created_ = false;
};

SequenceRun run_with_progress(RgbdSource& source, Pipeline& pipeline, std::size_t max_frames,
                              const FrameFolder* overlays) {
  const std::size_t total = max_frames > 0 && max_frames < source.size() ? max_frames : source.size();
  std::optional<ProgressBar> bar;
  if (says_remarks()) bar.emplace("tracking", total);
  std::size_t lost = 0, seen_frames = 0;
  RunHooks hooks;
  hooks.stop = interrupted;
  hooks.frame_done = [&](const RgbdFrame& frame) {
    if (!overlays) return;
    const auto verdict = [&](InstanceId id) { return pipeline.instances().verdict(id); };
    const TrackedFrame& tracked = pipeline.last_tracked();
    cv::Mat picture = draw_instances(frame.color, pipeline.last_instances(), verdict, tracked.weights);
    draw_features(picture, tracked, tracked.weights, pipeline.camera());
    overlays->add(frame.timestamp, ".jpg", picture);
  };
  hooks.item_taken = [&](const SequenceRun& run) {
    if (!bar) return;
    if (run.frames.size() > seen_frames && run.frames.back().result.state == TrackingState::kLost) ++lost;
    seen_frames = run.frames.size();
    if (lost + run.skipped.size() > 0) {
      bar->set_note(fmt::format("{} lost, {} skipped", lost, run.skipped.size()));
    }
    bar->advance();
  };
  return run_sequence(source, pipeline, hooks, max_frames);
}

// Whether most of what was tracked lies in the map that was loaded.
bool is_in_loaded_map(const Pipeline& pipeline, const RunSetting& setting) {
  return pipeline.trajectory_parts().front().part.value < setting.loaded_parts;
}

// Says what went wrong with the sequence as a whole.
void judge(const SequenceRun& result, const RunOptions& options, const RunSetting& setting,
           const Pipeline& pipeline) {
  if (result.interrupted) {
    log().warn("interrupted; the results cover what was read until then");
  } else if (result.frames.empty()) {
    throw UserError(fmt::format(
        "'{}': none of its {} frames could be used ({}); check the images and --camera",
        options.sequence.folder.string(), result.skipped.size(), fmt::join(skip_lines(result), "; ")));
  } else if (result.count(TrackingState::kTracking) == 0 && setting.loaded_parts > 0) {
    log().warn("no place of '{}' was recognised in {} frames and the trajectory is empty", setting.loaded_map,
               result.frames.size());
  } else if (result.count(TrackingState::kTracking) == 0) {
    log().warn(
        "no map could be started and the trajectory is empty: none of {} frames had {} keypoints with depth "
        "(tracking.min_initial_depths); check the depth images and the camera's depth_scale",
        result.frames.size(), setting.config.tracking.min_initial_depths);
  } else if (const std::size_t lost = result.count(TrackingState::kLost); 10 * lost > result.frames.size()) {
    log().warn("{} of {} frames were lost; the trajectory and its errors say nothing of them", lost,
               result.frames.size());
  }
  if (setting.loaded_parts > 0 && result.count(TrackingState::kTracking) > 0 &&
      !is_in_loaded_map(pipeline, setting)) {
    log().warn(
        "the trajectory is not in the world of '{}': most frames are in a part that was not joined to it",
        setting.loaded_map);
  }
}

// The cloud of the whole run; nothing where there is none to be made.
std::optional<FusedRun> fuse(Pipeline& pipeline) {
  if (pipeline.dense() == nullptr) return std::nullopt;
  const Stopwatch stopwatch;
  std::optional<ProgressBar> bar;
  const std::size_t most = 3 * pipeline.dense()->dense().views().ids().size();
  if (says_remarks()) bar.emplace("fusing", most, "steps");
  std::size_t steps = 0;
  DenseMap::Result fused = pipeline.fuse([&] {
    if (bar && steps++ < most) bar->advance();
  });
  // Fewer where views are in the volume already, or of another part.
  if (bar && steps < most) bar->advance(most - steps);
  return FusedRun{std::move(fused), stopwatch.milliseconds() / 1000.0};
}

void write_cloud(const OutputFolder& output, const RunOptions& options, const Pipeline& pipeline,
                 const FusedRun& fused) {
  const DenseMap& dense = pipeline.dense()->dense();
  options.cloud.write(output.path(), fused.result, dense, pipeline.keyframe_trajectory());
  if (!options.save_keyframes) return;
  pipeline.mapping().read([&](const Map& map, const std::vector<MappingRecord>&) {
    write_keyframe_folder(output / "keyframes", dense.views(),
                          pipeline.dense()->views().kept(map, &pipeline.instances().dynamic()),
                          pipeline.camera());
  });
}

void write_results(const OutputFolder& output, const RunOptions& options, const SequenceRun& result,
                   const RunSetting& setting, const std::optional<Trajectory>& truth, Pipeline& pipeline,
                   FrameFolder* overlays) {
  const std::vector<TrajectoryPart> parts = pipeline.trajectory_parts();
  const Trajectory& trajectory = parts.front().poses;
  const std::optional<Evaluation> evaluation = evaluate_run(truth, trajectory);
  output.make_way();
  if (overlays) overlays->keep();
  write_trajectory(output / "trajectory.txt", parts);
  write_trajectory(output / "keyframes.txt", pipeline.keyframe_parts());
  write_file_atomically(output / "timings.csv", timings_csv(result));
  if (setting.config.segmentation.segmenter != "none") {
    write_file_atomically(output / "instances.jsonl",
                          instances_jsonl(result, pipeline.instances().dynamic()));
  }
  if (evaluation) {
    write_trajectory_plot(output / "trajectory.png", *truth, trajectory, evaluation->ate,
                          {.title = fs::weakly_canonical(setting.sequence).filename().string()});
  }
  pipeline.mapping().read([&](const Map& map, const std::vector<MappingRecord>&) {
    write_file_atomically(output / "lines.ply", lines_ply(map));
    write_image_atomically(output / "map.png", draw_map_view(map, parts.front()));
  });
  // Last: what was tracked is not to be lost for it.
  std::optional<FusedRun> fused;
  std::exception_ptr no_cloud;
  try {
    fused = fuse(pipeline);
    if (fused) write_cloud(output, options, pipeline, *fused);
  } catch (const std::exception&) {
    no_cloud = std::current_exception();
  }
  write_file_atomically(output / "summary.json",
                        json_text(run_summary(result, setting, pipeline, evaluation ? &*evaluation : nullptr,
                                              fused ? &*fused : nullptr)));
  fmt::print("{}", run_text(result, pipeline, fused ? &*fused : nullptr));
  if (evaluation) fmt::print("{}", evaluation_table({*evaluation}));
  fmt::print("results in {}\n", output.path().string());
  if (no_cloud) std::rethrow_exception(no_cloud);
}

// The map may be wanted inside the output folder, so that has to be there.
void check_map_target(const RunOptions& options, const OutputFolder& output) {
  if (options.save_map.empty()) return;
  try {
    check_writable(options.save_map);
  } catch (const UserError&) {
    output.leave_no_trace();
    throw;
  }
}

void save(const RunOptions& options, const Pipeline& pipeline) {
  if (options.save_map.empty()) return;
  pipeline.mapping().read([&](const Map& map, const std::vector<MappingRecord>&) {
    if (map.keyframes().size() == 0) {
      log().warn("there is no map to save; '{}' was not written", options.save_map.string());
    } else {
      save_map(options.save_map, map, pipeline.camera());
    }
  });
}

// What is asked for and cannot be made is to be known before an hour of tracking.
void check_cloud(const RunOptions& options, const Config& config) {
  options.cloud.check();
  if (!options.cloud.any() && !options.save_keyframes) return;
  for (const auto& [hinders, reason] : {std::pair(!config.dense.enabled, "dense.enabled=false"),
                                        {options.localize_only, "--localize-only"}}) {
    if (!hinders) continue;
    throw UserError(fmt::format(
        "with {} no cloud is made, nor what is made of it (--save-keyframes, --label-colors, --pcd, --mesh, "
        "--occupancy, --octomap)",
        reason));
  }
}

void run(const RunOptions& options) {
  Config config = options.sequence.load_config();
  options.segmenter.apply(config);
  options.sequence.check_output(options.output);
  check_kept(options.segmenter.masks, options.output);
  check_cloud(options, config);
  if (options.realtime) config.schedule.mode = "realtime";
  if (options.threads > 0) config.schedule.threads = options.threads;
  const Camera camera = options.sequence.load_camera();
  std::optional<Map> loaded;
  if (!options.load_map.empty()) loaded = load_fitting_map(options.load_map, camera, config);
  auto dataset =
      std::make_unique<TumDataset>(options.sequence.folder, camera, options.sequence.dataset_options());
  const RunSetting setting{.sequence = options.sequence.folder.string(),
                           .preset = options.sequence.preset,
                           .camera = camera,
                           .config = config,
                           .unpaired_color = dataset->unpaired_color(),
                           .loaded_map = options.load_map.string(),
                           .loaded_parts = loaded ? loaded->new_part().value : 0,
                           .localize_only = options.localize_only};
  if (setting.unpaired_color > 0 && says_remarks()) {
    fmt::print("{} color images have no depth image within {} s and are left out\n", setting.unpaired_color,
               options.sequence.dataset.max_difference);
  }
  const std::optional<Trajectory> truth = read_ground_truth(*dataset);
  install_interrupt_handler();

  const std::unique_ptr<RgbdSource> source = open_source(std::move(dataset), config, options.realtime);
  // Before the output folder: it may find that there is no such model.
  if (loaded && !config.loops.enabled) {
    log().warn(
        "with loops.enabled=false no place of '{}' is recognised: the camera must start where that map ends",
        options.load_map.string());
  }
  Pipeline pipeline(camera, config, std::move(loaded), options.localize_only);
  const OutputFolder output(options.output);
  check_map_target(options, output);
  std::optional<FrameFolder> overlays;
  if (options.save_overlays) overlays.emplace(output / "overlays");
  const SequenceRun result =
      run_with_progress(*source, pipeline, options.sequence.max_frames, overlays ? &*overlays : nullptr);
  try {
    judge(result, options, setting, pipeline);
  } catch (const UserError&) {
    overlays.reset();
    output.leave_no_trace();
    throw;
  }
  for (const std::string& remark : pipeline.instances().remarks()) log().warn("{}", remark);
  const auto write = [&] {
    write_results(output, options, result, setting, truth, pipeline, overlays ? &*overlays : nullptr);
  };
  try {
    save(options, pipeline);
  } catch (const UserError&) {
    write();  // one is not to be lost because the other cannot be written
    throw;
  }
  write();
  if (result.interrupted) exit_code() = kInterrupted;
}

}  // namespace

void add_run_verb(CLI::App& app) {
  auto* verb = app.add_subcommand("run", "Track and map a recorded RGB-D sequence");
  auto options = std::make_shared<RunOptions>();
  options->sequence.add_to(*verb);
  options->segmenter.add_to(*verb);
  verb->add_option(
          "-o,--output", options->output,
          "Folder for the results, made if need be: trajectory.txt, keyframes.txt, cloud.ply, objects.json, "
          "lines.ply, instances.jsonl, timings.csv, map.png, summary.json and, with ground truth, "
          "trajectory.png")
      ->type_name("RUN_DIR")
      ->check(not_empty())
      ->required();
  verb->add_flag("--save-overlays", options->save_overlays,
                 "Write each frame with its points, lines and instances drawn in to RUN_DIR/overlays");
  options->cloud.add_to(*verb);
  verb->add_flag("--save-keyframes", options->save_keyframes,
                 "Write the keyframes' images and masks to RUN_DIR/keyframes, for `ipl_slam map export`");
  verb->add_option("--save-map", options->save_map,
                   "Write the map to this file at the end, to go on with it or to export it (`ipl_slam map`)")
      ->type_name("FILE")
      ->check(not_empty());
  auto* load =
      verb->add_option("--load-map", options->load_map,
                       "Go on with a map saved before: the trajectory is in its world, from the first "
                       "place of it that is recognised on")
          ->type_name("FILE")
          ->check(not_empty());
  verb->add_flag("--localize-only", options->localize_only,
                 "With --load-map: leave the map as it is, only find the camera in it")
      ->needs(load);
  verb->add_flag("--realtime", options->realtime,
                 "Play at recorded speed, with segmentation and mapping on threads of their own; frames that "
                 "come too late are dropped and counted, and no two runs are alike");
  verb->add_option("--threads", options->threads,
                   "Threads inside a stage, 1 to 64; the result does not depend on it (default: 1)")
      ->type_name("N")
      ->check(CLI::Range(1, 64));
  verb->callback([options] { run(*options); });
}

}  // namespace ipl_slam::cli
