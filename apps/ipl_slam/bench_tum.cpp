#include "bench_tum.hpp"

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <ipl_slam/error.hpp>
#include <ipl_slam/version.hpp>

#include "common/atomic_file.hpp"
#include "common/fingerprint.hpp"
#include "common/interrupt.hpp"
#include "common/log.hpp"
#include "common/nearest_name.hpp"
#include "common/progress.hpp"
#include "common/text_file.hpp"
#include "dataset/camera_config.hpp"
#include "dataset/find_sequences.hpp"
#include "evaluation/benchmark_tables.hpp"
#include "output.hpp"
#include "pipeline/benchmark_configurations.hpp"
#include "pipeline/run_report.hpp"
#include "pipeline/sequence_run.hpp"
#include "segmenter_choice.hpp"
#include "sequence_input.hpp"
#include "sequence_options.hpp"
#include "verbs.hpp"

namespace ipl_slam::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct BenchTumOptions {
  fs::path datasets, output;
  SequenceOptions settings;  // what all runs have in common
  SegmenterChoice segmenter;
  std::vector<std::string> presets = preset_names();
  std::vector<std::string> compare;
  int runs = 5;
  int realtime_runs = 0;
  bool realtime = false;
  bool ablation = false;
  bool force = false;

  [[nodiscard]] int runs_in_realtime() const { return realtime ? runs : realtime_runs; }
};

// A sequence that was found, and what is the same for all its runs.
struct Sequence {
  BenchmarkSequence about;
  fs::path folder;
  Camera camera;
  std::size_t frames = 0;
  std::optional<Trajectory> truth;
  std::string hash;
};

// The settings of run `run` of a configuration.
struct Variant {
  BenchmarkConfiguration configuration;
  int run = 0;
  Config config;
  std::string segmenter;  // for people
  std::string hash;
};

// A run of the plan, and its record as soon as there is one.
struct PlannedRun {
  const Sequence* sequence;
  const Variant* variant;
  fs::path file;
  std::optional<BenchmarkRecord> record;

  [[nodiscard]] BenchmarkKey key() const {
    return {kVersion,     sequence->about.name, variant->configuration.name,
            variant->run, variant->hash,        sequence->hash};
  }
  [[nodiscard]] std::string name() const {
    return fmt::format("{}, {}, run {}", sequence->about.name, variant->configuration.name, variant->run);
  }
};

// Changes with everything that a run reads besides the images.
std::string hash_of_sequence(const fs::path& folder, const Camera& c) {
  std::string content = fmt::format("{} {} {} {} {} {} {} {} {} {} {} {}\n", c.width, c.height, c.fx, c.fy,
                                    c.cx, c.cy, c.k1, c.k2, c.p1, c.p2, c.k3, c.depth_scale);
  for (const char* list : {"rgb.txt", "depth.txt", "associations.txt", "associate.txt", "groundtruth.txt"}) {
    std::error_code ignored;
    if (fs::is_regular_file(folder / list, ignored)) content += read_file(folder / list);
    content += '\n';
  }
  return fingerprint(content);
}

std::string name_of_sequence(const fs::path& folder, const fs::path& root) {
  const fs::path relative = folder.lexically_relative(root);
  return relative == "." ? fs::weakly_canonical(root).filename().string() : relative.generic_string();
}

Sequence inspect(const fs::path& folder, const BenchTumOptions& options) {
  Sequence sequence;
  sequence.folder = folder;
  sequence.about.name = name_of_sequence(folder, options.datasets);
  // The figures of a whole sequence say nothing about the first frames of it.
  if (options.settings.max_frames == 0) {
    sequence.about.published = find_published(fs::path(sequence.about.name).filename().string());
  }
  try {
    const std::optional<std::string> camera = guess_camera(folder);
    // The lists come first: a folder that is no sequence needs no camera.
    (void)TumDataset(folder, Camera{});
    if (!camera) throw UserError("its name does not tell the camera; put a camera.yaml into the folder");
    sequence.camera = load_camera(*camera);
    const TumDataset dataset(folder, sequence.camera);
    sequence.frames = options.settings.max_frames > 0 ? std::min(options.settings.max_frames, dataset.size())
                                                      : dataset.size();
    sequence.truth = read_ground_truth(dataset);
    sequence.hash = hash_of_sequence(folder, sequence.camera);
  } catch (const UserError& error) {
    sequence.about.problem = error.what();
  }
  return sequence;
}

std::vector<Sequence> inspect_all(const BenchTumOptions& options) {
  std::vector<Sequence> sequences;
  for (const fs::path& folder : find_sequences(options.datasets)) {
    sequences.push_back(inspect(folder, options));
    const Sequence& s = sequences.back();
    if (!s.about.problem.empty()) {
      log().warn("{} is not run: {}", s.about.name, s.about.problem);
    } else if (says_remarks()) {
      fmt::print("{}: {} frames, camera {}{}{}\n", s.about.name, s.frames, s.camera.name,
                 s.truth ? "" : ", no ground truth",
                 s.about.published ? fmt::format(", {} of the paper", s.about.published->name) : "");
    }
  }
  if (sequences.empty()) {
    throw UserError(
        fmt::format("'{}': no sequence in or below this folder; one is a folder with rgb.txt, "
                    "depth.txt and, to be measured, groundtruth.txt",
                    options.datasets.string()));
  }
  return sequences;
}

Variant make_variant(const BenchTumOptions& options, const BenchmarkConfiguration& configuration, int run) {
  Variant variant{configuration, run, {}, {}, {}};
  SequenceOptions settings = options.settings;
  settings.preset = configuration.preset;
  for (const std::string& setting : configuration.overrides) settings.settings.push_back(setting);
  for (const std::string& setting : run_overrides(configuration, run)) settings.settings.push_back(setting);
  variant.config = settings.load_config();
  variant.segmenter = options.segmenter.resolve(variant.config);
  variant.hash = fingerprint(
      fmt::format("{} {}", options.settings.max_frames, options_json(option_table(variant.config)).dump()));
  return variant;
}

// By run first, so that every configuration has its first result early.
std::vector<Variant> make_variants(const BenchTumOptions& options) {
  std::vector<Variant> variants;
  for (int run = 0; run < std::max(options.runs, options.runs_in_realtime()); ++run) {
    for (const std::string& preset : options.presets) {
      if (run < options.runs) {
        for (const Ablation& ablation : ablations()) {
          const bool wanted = options.ablation || ablation.overrides.empty();
          if (wanted)
            variants.push_back(make_variant(options, ablation_configuration(preset, ablation), run));
        }
      }
      if (run < options.runs_in_realtime()) {
        variants.push_back(make_variant(options, realtime_configuration(preset), run));
      }
    }
  }
  return variants;
}

std::vector<std::string> configuration_names(const std::vector<Variant>& variants) {
  std::vector<std::string> names;
  for (const Variant& variant : variants) {
    const std::string& name = variant.configuration.name;
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  return names;
}

void check(const BenchTumOptions& options) {
  if (options.runs == 0 && options.runs_in_realtime() == 0) {
    throw UserError("--runs 0 leaves nothing to do; give --realtime-runs as well");
  }
  if (std::set<std::string>(options.presets.begin(), options.presets.end()).size() < options.presets.size()) {
    throw UserError("--presets names one twice; give each once");
  }
  if (options.ablation && options.runs == 0) {
    throw UserError("--ablation needs runs in lockstep; leave out --runs 0");
  }
}

void check_compared(const std::vector<std::string>& compared, const std::vector<std::string>& names) {
  for (const std::string& name : compared) {
    if (std::find(names.begin(), names.end(), name) != names.end()) continue;
    throw UserError(
        fmt::format("--compare: there is no configuration '{}' among those to run; did you mean '{}'? "
                    "There are: {}",
                    name, nearest_name(name, names), fmt::join(names, ", ")));
  }
  if (!compared.empty() && compared[0] == compared[1]) {
    throw UserError(fmt::format("--compare names '{}' twice; give two configurations", compared[0]));
  }
}

// A missing model would fail every run; better to fail before the first.
void check_segmenters(const std::vector<Variant>& variants, const std::vector<Sequence>& sequences) {
  const auto some = std::find_if(sequences.begin(), sequences.end(),
                                 [](const Sequence& s) { return s.about.problem.empty(); });
  if (some == sequences.end()) return;
  std::vector<std::string> checked;
  for (const Variant& v : variants) {
    if (std::find(checked.begin(), checked.end(), v.configuration.name) != checked.end()) continue;
    checked.push_back(v.configuration.name);
    (void)make_segmenter(v.config.segmentation, some->camera);
  }
}

std::optional<BenchmarkRecord> earlier_record(const PlannedRun& run) {
  std::error_code ignored;
  if (!fs::is_regular_file(run.file, ignored)) return std::nullopt;
  std::optional<BenchmarkRecord> record = parse_record(read_file(run.file));
  return record && record->key == run.key() ? record : std::nullopt;
}

std::vector<PlannedRun> make_plan(const BenchTumOptions& options, const std::vector<Variant>& variants,
                                  const std::vector<Sequence>& sequences) {
  std::vector<PlannedRun> plan;
  for (const Variant& variant : variants) {
    for (const Sequence& sequence : sequences) {
      if (!sequence.about.problem.empty()) continue;
      plan.push_back({&sequence, &variant,
                      options.output / "runs" / sequence.about.name / variant.configuration.name /
                          fmt::format("{}.json", variant.run),
                      std::nullopt});
      if (!options.force) plan.back().record = earlier_record(plan.back());
    }
  }
  return plan;
}

// Runs the system once; the summary of the run, or nothing where it was interrupted. Throws where it has no
// result.
std::optional<Json> run_once(const PlannedRun& planned, std::size_t max_frames,
                             const std::function<void()>& frame_taken) {
  const Sequence& sequence = *planned.sequence;
  Config config = planned.variant->config;
  config.dense.enabled = false;  // it has no part in the path
  auto dataset = std::make_unique<TumDataset>(sequence.folder, sequence.camera);
  const RunSetting setting{sequence.folder.string(), planned.variant->configuration.preset, sequence.camera,
                           config, dataset->unpaired_color()};
  const auto source = open_source(std::move(dataset), config, planned.variant->configuration.realtime);
  Pipeline pipeline(sequence.camera, config);
  RunHooks hooks;
  hooks.stop = interrupted;
  hooks.item_taken = [&](const SequenceRun&) { frame_taken(); };
  const SequenceRun run = run_sequence(*source, pipeline, hooks, max_frames);
  if (run.interrupted) return std::nullopt;
  if (run.frames.empty()) {
    throw UserError(fmt::format("none of its {} frames could be used ({})", run.skipped.size(),
                                fmt::join(skip_lines(run), "; ")));
  }
  if (run.count(TrackingState::kTracking) == 0) {
    throw UserError(fmt::format("no map could be started, none of {} frames was tracked", run.frames.size()));
  }
  const std::optional<Evaluation> evaluation = evaluate_run(sequence.truth, pipeline.trajectory());
  return run_summary(run, setting, pipeline, evaluation ? &*evaluation : nullptr);
}

void say_result(const PlannedRun& run) {
  ProgressBar::hide_drawn_line();
  const BenchmarkRecord& r = *run.record;
  if (!r.ok()) {
    log().warn("{}: failed: {}", run.name(), r.failure);
  } else if (says_remarks()) {
    fmt::print("{}: {}{} of {} frames tracked\n", run.name(),
               r.errors ? fmt::format("ATE {:.4f} m, ", r.errors->ate_rmse) : "", r.tracked, r.frames);
  }
}

// Runs what has no good record yet and writes each record at once. A run that fails gets a record, too.
void execute(std::vector<PlannedRun*> pending, const BenchTumOptions& options) {
  std::size_t total = 0;
  for (const PlannedRun* run : pending) total += run->sequence->frames;
  std::optional<ProgressBar> bar;
  if (says_remarks()) bar.emplace("benchmark", total);
  for (std::size_t i = 0; i < pending.size(); ++i) {
    PlannedRun& run = *pending[i];
    std::size_t taken = 0;
    const auto advance = [&](std::size_t frames) {
      taken += frames;
      if (bar) bar->advance(frames);
    };
    if (bar) bar->set_note(fmt::format("run {}/{}: {}", i + 1, pending.size(), run.name()));
    Json record;
    try {
      const std::optional<Json> summary = run_once(run, options.settings.max_frames, [&] { advance(1); });
      if (!summary) return;
      record = record_of_run(run.key(), *summary);
    } catch (const std::exception& error) {
      record = record_of_failure(run.key(), error.what());
    }
    if (taken < run.sequence->frames) advance(run.sequence->frames - taken);
    const std::string text = json_text(record);
    make_folder(run.file.parent_path());
    write_file_atomically(run.file, text);
    run.record = parse_record(text);
    say_result(run);
  }
}

BenchmarkResults gather(const BenchTumOptions& options, const std::vector<Sequence>& sequences,
                        const std::vector<std::string>& names, const std::vector<PlannedRun>& plan) {
  BenchmarkResults results;
  for (const Sequence& sequence : sequences) results.sequences.push_back(sequence.about);
  for (const std::string& preset : options.presets) {
    for (const std::string& name :
         {lockstep_configuration(preset).name, realtime_configuration(preset).name}) {
      if (std::find(names.begin(), names.end(), name) != names.end()) results.configurations.push_back(name);
    }
    if (!options.ablation) continue;
    AblationRow row{preset, {}};
    std::transform(ablations().begin(), ablations().end(), row.configurations.begin(),
                   [&](const Ablation& a) { return ablation_configuration(preset, a).name; });
    results.ablation.push_back(row);
  }
  if (!options.compare.empty()) {
    results.compared.emplace(options.compare[0], options.compare[1]);
  } else if (results.configurations.size() > 1) {
    results.compared.emplace(results.configurations[0], results.configurations[1]);
  }
  for (const PlannedRun& run : plan) {
    if (run.record) results.records.push_back(*run.record);
  }
  return results;
}

std::string markdown_head(const BenchTumOptions& options, const std::vector<Variant>& variants,
                          const std::vector<PlannedRun>& plan) {
  std::string head = fmt::format("# Benchmark of ipl_slam {}\n\n", kVersion);
  if (options.runs > 0) head += fmt::format("{} runs of each sequence in lockstep", options.runs);
  if (const int n = options.runs_in_realtime(); n > 0) {
    head += fmt::format("{}{} in realtime", options.runs > 0 ? ", " : "Runs of each sequence: ", n);
  }
  if (options.settings.max_frames > 0) head += fmt::format(", first {} frames", options.settings.max_frames);
  head += fmt::format("; segmenter: {}.\n", variants.front().segmenter);
  if (!options.settings.config_file.empty()) {
    head += fmt::format("Settings that differ from the presets: {}.\n", options.settings.config_file);
  }
  if (!options.settings.settings.empty()) {
    head += fmt::format("Settings that differ from the presets: {}.\n",
                        fmt::join(options.settings.settings, ", "));
  }
  const auto there =
      std::count_if(plan.begin(), plan.end(), [](const PlannedRun& run) { return run.record.has_value(); });
  if (static_cast<std::size_t>(there) < plan.size()) {
    head += fmt::format("**Interrupted: {} of {} runs are in these tables.**\n", there, plan.size());
  }
  return head + '\n';
}

void write_tables(const BenchTumOptions& options, const std::vector<Variant>& variants,
                  const std::vector<PlannedRun>& plan, const BenchmarkResults& results) {
  const std::vector<Table> tables = benchmark_tables(results);
  write_file_atomically(options.output / "tables.md",
                        markdown_head(options, variants, plan) + tables_markdown(tables));
  write_file_atomically(options.output / "tables.csv", tables_csv(tables));
  write_file_atomically(options.output / "tables.json",
                        json_text({{"version", kVersion}, {"tables", tables_json(tables)}}));
  fmt::print("\n{}\ntables in {}\n", tables_markdown({&tables.front(), 1}),
             (options.output / "tables.md").string());
}

// The runs without a good record; says how many there are.
std::vector<PlannedRun*> outstanding(std::vector<PlannedRun>& plan, const BenchTumOptions& options) {
  std::vector<PlannedRun*> pending;
  std::size_t failed = 0, of_others = 0;
  for (PlannedRun& run : plan) {
    if (run.record && run.record->ok()) continue;
    pending.push_back(&run);
    failed += run.record ? 1 : 0;
    std::error_code ignored;
    of_others += !run.record && fs::is_regular_file(run.file, ignored) ? 1 : 0;
  }
  if (!says_remarks()) return pending;
  if (const std::size_t kept = plan.size() - pending.size(); kept > 0) {
    fmt::print("{} of {} runs are there already with these settings and are kept (--force runs them anew)\n",
               kept, plan.size());
  }
  if (failed > 0) fmt::print("failed before and tried again: {}\n", failed);
  if (of_others > 0 && !options.force) {
    fmt::print("results of other settings, data or another version, replaced one by one: {}\n", of_others);
  }
  if (pending.empty() && !plan.empty()) fmt::print("nothing to run\n");
  return pending;
}

// Says what is missing from the tables; an error where that is everything.
void judge(const std::vector<Sequence>& sequences, const std::vector<PlannedRun>& plan) {
  const auto problem = std::find_if(sequences.begin(), sequences.end(),
                                    [](const Sequence& s) { return !s.about.problem.empty(); });
  if (plan.empty()) {
    throw UserError(fmt::format("none of the {} sequences could be run; the first: {}: {}", sequences.size(),
                                problem->about.name, problem->about.problem));
  }
  const auto is_good = [](const PlannedRun& run) { return run.record && run.record->ok(); };
  const auto failed = static_cast<std::size_t>(std::count_if(
      plan.begin(), plan.end(), [](const PlannedRun& run) { return run.record && !run.record->ok(); }));
  if (std::none_of(plan.begin(), plan.end(), is_good) && failed > 0) {
    throw UserError(fmt::format("all {} runs failed; the first: {}: {}", failed, plan.front().name(),
                                plan.front().record->failure));
  }
  const auto left_out = std::count_if(sequences.begin(), sequences.end(),
                                      [](const Sequence& s) { return !s.about.problem.empty(); });
  if (left_out > 0)
    fmt::print("{} of {} sequences could not be run (reasons in the tables)\n", left_out, sequences.size());
  if (failed > 0) fmt::print("{} of {} runs failed (reasons in the tables)\n", failed, plan.size());
}

void bench_tum(const BenchTumOptions& options) {
  check(options);
  const std::vector<Variant> variants = make_variants(options);
  const std::vector<std::string> names = configuration_names(variants);
  check_compared(options.compare, names);
  const std::vector<Sequence> sequences = inspect_all(options);
  check_segmenters(variants, sequences);
  if (says_remarks()) fmt::print("segmenter: {}\n", variants.front().segmenter);

  make_folder(options.output / "runs");
  std::vector<PlannedRun> plan = make_plan(options, variants, sequences);
  install_interrupt_handler();
  execute(outstanding(plan, options), options);
  write_tables(options, variants, plan, gather(options, sequences, names, plan));
  if (interrupted()) {
    log().warn("interrupted; the same command goes on where it stopped");
    exit_code() = kInterrupted;
    return;
  }
  judge(sequences, plan);
}

}  // namespace

void add_bench_tum(CLI::App& bench) {
  auto* verb = bench.add_subcommand(
      "tum", "Run all TUM and Bonn sequences below a folder several times and write the tables of the paper");
  auto o = std::make_shared<BenchTumOptions>();
  verb->add_option(
          "datasets", o->datasets,
          "Folder with sequences in TUM RGB-D layout, at any depth; the camera of each is that of its "
          "camera.yaml, or told by its name")
      ->type_name("DATASETS_DIR")
      ->check(not_empty())
      ->required();
  verb->add_option(
          "-o,--output", o->output,
          "Folder for tables.md, tables.csv, tables.json and a file per run, made if need be. With the "
          "results of an earlier call it goes on where that one stopped")
      ->type_name("OUT_DIR")
      ->check(not_empty())
      ->required();
  verb->add_option("--presets", o->presets, "Presets to run, separated by commas")
      ->type_name("NAMES")
      ->delimiter(',')
      ->check(CLI::IsMember(preset_names()))
      ->capture_default_str();
  verb->add_option("--runs", o->runs,
                   "Runs in lockstep of each sequence; from the second on with a noise of one grey value, "
                   "without which all would be alike")
      ->type_name("N")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  auto* realtime = verb->add_flag("--realtime", o->realtime,
                                  "As many runs in realtime besides. They play at recorded speed, so they "
                                  "last as long as the recordings");
  verb->add_option("--realtime-runs", o->realtime_runs, "So many runs in realtime")
      ->type_name("N")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str()
      ->excludes(realtime);
  verb->add_flag("--ablation", o->ablation,
                 "Also run each preset without lines, motion checks and weights: Table 3");
  verb->add_option("--compare", o->compare,
                   "Two configurations to test for a difference, by name, e.g. --compare default "
                   "default-realtime (default: the first two)")
      ->type_name("A B")
      ->expected(2);
  verb->add_flag("--force", o->force, "Run anew what is there already");
  o->settings.add_settings_to(*verb);
  o->settings.add_max_frames_to(*verb);
  o->segmenter.add_to(*verb);
  verb->callback([o] { bench_tum(*o); });
}

}  // namespace ipl_slam::cli
