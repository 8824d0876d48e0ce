#include <memory>

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

#include "common/atomic_file.hpp"
#include "common/interrupt.hpp"
#include "common/log.hpp"
#include "common/progress.hpp"
#include "dataset/prefetching_source.hpp"
#include "dataset/trajectory.hpp"
#include "evaluation/report.hpp"
#include "evaluation/trajectory_plot.hpp"
#include "pipeline/map_view.hpp"
#include "pipeline/realtime_source.hpp"
#include "pipeline/run_report.hpp"
#include "pipeline/sequence_run.hpp"
#include "sequence_options.hpp"
#include "verbs.hpp"

namespace ipl_slam::cli {
namespace {

namespace fs = std::filesystem;

struct RunOptions {
  SequenceOptions sequence;
  fs::path output;
  bool realtime = false;
  int threads = 0;
};

// Fails now rather than after an hour of tracking.
void prepare_output(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) {
    throw UserError(fmt::format("{}: cannot create the output folder ({}); choose another with -o",
                                folder.string(), error.message()));
  }
  const fs::path probe = folder / "summary.json";
  if (!fs::exists(probe)) {
    write_file_atomically(probe, "{}\n");
    fs::remove(probe);
  }
}

SequenceRun run_with_progress(RgbdSource& source, Pipeline& pipeline, std::size_t max_frames) {
  const std::size_t total = max_frames > 0 && max_frames < source.size() ? max_frames : source.size();
  ProgressBar bar("tracking", total);
  std::size_t lost = 0, skipped = 0, seen = 0;
  const auto stop = [&] { return interrupted() || (max_frames > 0 && seen >= max_frames); };
  SequenceRun run = run_sequence(source, pipeline, stop, [&](const SequenceRun& so_far) {
    ++seen;
    if (!so_far.frames.empty() && so_far.frames.size() + so_far.skipped.size() == seen) {
      lost = so_far.count(TrackingState::kLost);
    }
    skipped = so_far.skipped.size();
    if (lost + skipped > 0) bar.set_note(fmt::format("{} lost, {} skipped", lost, skipped));
    bar.advance();
  });
  run.interrupted = interrupted();
  return run;
}

// Compares with groundtruth.txt, if there is one, and draws both paths.
std::optional<Evaluation> evaluate_run(const std::optional<fs::path>& ground_truth,
                                       const Trajectory& trajectory, const RunOptions& options) {
  if (!ground_truth) return std::nullopt;
  try {
    const Trajectory truth = read_trajectory(*ground_truth);
    Evaluation evaluation = evaluate(truth, trajectory, "run");
    write_trajectory_plot(options.output / "trajectory.png", truth, trajectory, evaluation.ate,
                          {.title = fs::weakly_canonical(options.sequence.folder).filename().string()});
    return evaluation;
  } catch (const UserError& error) {
    // The run itself is good; only its accuracy stays unknown.
    log().warn("no evaluation: {}", error.what());
    return std::nullopt;
  }
}

void run(const RunOptions& options) {
  Config config = options.sequence.load_config();
  if (options.realtime) config.schedule.mode = "realtime";
  if (options.threads > 0) config.schedule.threads = options.threads;
  const Camera camera = options.sequence.load_camera();
  auto dataset = std::make_unique<TumDataset>(options.sequence.folder, camera, options.sequence.dataset);
  const std::optional<fs::path> ground_truth = dataset->ground_truth();
  prepare_output(options.output);
  install_interrupt_handler();

  std::unique_ptr<RgbdSource> source = std::make_unique<PrefetchingSource>(std::move(dataset));
  if (options.realtime) {
    source = std::make_unique<RealtimeSource>(std::move(source),
                                              static_cast<std::size_t>(config.schedule.frame_queue));
  }
  Pipeline pipeline(camera, config);
  const SequenceRun result = run_with_progress(*source, pipeline, options.sequence.max_frames);

  const Trajectory trajectory = pipeline.trajectory();
  write_trajectory(options.output / "trajectory.txt", trajectory);
  write_trajectory(options.output / "keyframes.txt", pipeline.keyframe_trajectory());
  write_file_atomically(options.output / "timings.csv", timings_csv(result));
  const std::optional<Evaluation> evaluation = evaluate_run(ground_truth, trajectory, options);
  const RunSetting setting{options.sequence.folder.string(), options.sequence.preset, camera, config};
  pipeline.mapping().read([&](const Map& map, const std::vector<MappingTime>&) {
    write_image_atomically(options.output / "map.png", draw_map_view(map, trajectory));
    write_file_atomically(
        options.output / "summary.json",
        run_summary(result, setting, map, evaluation ? &*evaluation : nullptr).dump(2) + "\n");
    fmt::print("{}", run_text(result, map));
  });
  if (evaluation) fmt::print("{}", evaluation_table({*evaluation}));
  fmt::print("results in {}\n", options.output.string());
}

}  // namespace

void add_run_verb(CLI::App& app) {
  auto* verb = app.add_subcommand("run", "Track and map a recorded RGB-D sequence");
  auto options = std::make_shared<RunOptions>();
  options->sequence.add_to(*verb);
  verb->add_option("-o,--output", options->output,
                   "Folder for trajectory.txt, keyframes.txt, summary.json, timings.csv and pictures")
      ->required();
  verb->add_flag(
      "--realtime", options->realtime,
      "Play at recorded speed with mapping on its own thread; late frames are dropped and counted");
  verb->add_option("--threads", options->threads, "Threads inside a stage; does not change the result")
      ->check(CLI::Range(1, 64));
  verb->callback([options] { run(*options); });
}

}  // namespace ipl_slam::cli
