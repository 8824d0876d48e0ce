#include "bench_places.hpp"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <ipl_slam/error.hpp>
#include <ipl_slam/version.hpp>

#include "common/atomic_file.hpp"
#include "common/interrupt.hpp"
#include "common/log.hpp"
#include "common/progress.hpp"
#include "common/stopwatch.hpp"
#include "dataset/association.hpp"
#include "dataset/prefetching_source.hpp"
#include "evaluation/precision_recall_plot.hpp"
#include "evaluation/statistics.hpp"
#include "evaluation/view_overlap.hpp"
#include "features/orb_extractor.hpp"
#include "loop/place_index.hpp"
#include "output.hpp"
#include "segmentation/class_role.hpp"
#include "segmentation/make_segmenter.hpp"
#include "segmenter_choice.hpp"
#include "sequence_input.hpp"
#include "sequence_options.hpp"
#include "verbs.hpp"

namespace ipl_slam::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr double kPositiveShare = 0.5, kNegativeShare = 0.1;

struct BenchPlacesOptions {
  std::vector<fs::path> sequences;
  fs::path output;
  SequenceOptions settings;
  SegmenterChoice segmenter;
  PlaceIndexOptions index;
  std::vector<std::string> index_settings;
  double gap = 5.0;
  int every = 1;
  bool together = false;
};

// A frame with a true pose.
struct View {
  std::size_t sequence = 0;
  double timestamp = 0.0;
  DepthView depth;
  std::vector<Descriptor> descriptors;  // of what does not move by itself
};

struct SequenceViews {
  std::string name;
  Camera camera;
  std::vector<View> views;
};

enum class Relation { same, different, unclear };

// What is known of one query.
struct Query {
  std::vector<PlaceCandidate> candidates;
  std::vector<Relation> relations;  // of the candidates
  bool has_positive = false, has_negative = false;
  double milliseconds = 0.0;

  [[nodiscard]] RetrievalOutcome outcome() const {
    RetrievalOutcome outcome{has_positive, {}, false};
    const auto answer = std::find_if(relations.begin(), relations.end(),
                                     [](Relation relation) { return relation != Relation::unclear; });
    if (answer == relations.end()) return outcome;
    outcome.score = candidates[static_cast<std::size_t>(answer - relations.begin())].score;
    outcome.correct = *answer == Relation::same;
    return outcome;
  }
  [[nodiscard]] bool found_within(std::size_t k) const {
    const auto end = relations.begin() + static_cast<std::ptrdiff_t>(std::min(k, relations.size()));
    return std::find(relations.begin(), end, Relation::same) != end;
  }
};

// What moves by itself, and what a segmenter without classes took for something that moves.
bool may_walk_off(const Instance& instance) {
  return instance.class_name == "unknown" || class_role(instance.class_name) == ClassRole::likely_mover;
}

BitMask moving_in(const RgbdFrame& frame, Segmenter* segmenter) {
  BitMask moving(frame.color.size());
  if (segmenter == nullptr) return moving;
  for (const Instance& instance : segmenter->segment(frame)) {
    if (may_walk_off(instance)) moving |= instance.mask;
  }
  return moving;
}

std::vector<Descriptor> static_descriptors(const Features& features, const BitMask& moving) {
  std::vector<Descriptor> descriptors;
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (!covers(moving, features.keypoints[i].pixel.cast<double>())) {
      descriptors.push_back(features.descriptors[i]);
    }
  }
  return descriptors;
}

// Poses at the times of the frames, where there is one.
class TruePoses {
 public:
  explicit TruePoses(Trajectory truth) : truth_(std::move(truth)) {}

  [[nodiscard]] std::optional<SE3> at(double timestamp) const {
    const auto after = std::lower_bound(truth_.begin(), truth_.end(), timestamp,
                                        [](const StampedPose& p, double t) { return p.timestamp < t; });
    auto nearest = after;
    if (after == truth_.end() ||
        (after != truth_.begin() && timestamp - std::prev(after)->timestamp < after->timestamp - timestamp)) {
      nearest = std::prev(after);
    }
    if (std::abs(nearest->timestamp - timestamp) >= kAssociationWindow) return std::nullopt;
    return nearest->T_wc;
  }

 private:
  Trajectory truth_;
};

// A relative folder of masks is looked for in the sequence first.
SegmenterChoice masks_of(SegmenterChoice choice, const fs::path& sequence) {
  std::error_code ignored;
  if (!choice.masks.empty() && fs::is_directory(sequence / choice.masks, ignored)) {
    choice.masks = sequence / choice.masks;
  }
  return choice;
}

SequenceViews read_views(const BenchPlacesOptions& options, const fs::path& folder, std::size_t number) {
  SequenceOptions settings = options.settings;
  settings.folder = folder;
  Config config = settings.load_config();
  masks_of(options.segmenter, folder).apply(config);
  SequenceViews sequence{folder.lexically_normal().string(), settings.load_camera(), {}};
  auto dataset = std::make_unique<TumDataset>(folder, sequence.camera);
  const std::optional<Trajectory> truth = read_ground_truth(*dataset);
  if (!truth) {
    throw UserError(
        fmt::format("'{}' has no usable groundtruth.txt, which this measure needs", sequence.name));
  }
  const TruePoses poses(*truth);
  const std::unique_ptr<Segmenter> segmenter =
      make_segmenter(config.segmentation, sequence.camera, config.schedule.seed);
  OrbExtractor extractor(config.orb, sequence.camera, config.depth);
  const std::size_t limit = settings.max_frames > 0 ? settings.max_frames : dataset->size();
  PrefetchingSource source(std::move(dataset));
  std::optional<ProgressBar> bar;
  if (says_remarks()) bar.emplace(folder.filename().string(), std::min(limit, source.size()));
  for (std::size_t count = 0; count < limit && !interrupted(); ++count) {
    const std::optional<SourceItem> item = source.next();
    if (!item) break;
    if (bar) bar->advance(1);
    if (!item->frame || count % static_cast<std::size_t>(options.every) != 0) continue;
    const RgbdFrame& frame = *item->frame;
    const BitMask moving = moving_in(frame, segmenter.get());
    const std::optional<SE3> T_wc = poses.at(frame.timestamp);
    if (!T_wc) continue;
    sequence.views.push_back({number, frame.timestamp,
                              make_depth_view(frame.depth, *T_wc, sequence.camera, moving),
                              static_descriptors(extractor.extract(frame.color, frame.depth), moving)});
  }
  return sequence;
}

Relation relation_of(const View& a, const View& b, const Camera& camera) {
  if (a.sequence != b.sequence) return Relation::different;
  const auto judge = [](double share) {
    if (share >= kPositiveShare) return Relation::same;
    return share < kNegativeShare ? Relation::different : Relation::unclear;
  };
  const Relation relation = judge(seen_share(a.depth, b.depth, camera));
  if (relation == Relation::unclear || judge(seen_share(b.depth, a.depth, camera)) != relation) {
    return Relation::unclear;
  }
  return relation;
}

// Asks for each view among those before it, then adds it.
std::vector<Query> ask(const BenchPlacesOptions& options, const std::vector<SequenceViews>& sequences) {
  std::size_t total = 0;
  for (const SequenceViews& sequence : sequences) total += sequence.views.size();
  std::optional<ProgressBar> bar;
  if (says_remarks()) bar.emplace("queries", total);
  std::vector<Query> queries;
  std::vector<const View*> added;  // by keyframe id
  std::optional<PlaceIndex> index;
  for (const SequenceViews& sequence : sequences) {
    if (!index || !options.together) {
      index.emplace(options.index);
      added.clear();
    }
    for (const View& view : sequence.views) {
      if (interrupted()) return queries;
      if (bar) bar->advance(1);
      const auto eligible = [&](KeyframeId id) {
        const View& other = *added[id.value];
        return other.sequence != view.sequence || view.timestamp - other.timestamp > options.gap;
      };
      Query query;
      const Stopwatch stopwatch;
      query.candidates = index->query(view.descriptors, eligible);
      query.milliseconds = stopwatch.milliseconds();
      std::vector<Relation> relations(added.size(), Relation::unclear);
      for (std::uint32_t i = 0; i < added.size(); ++i) {
        if (!eligible(KeyframeId{i})) continue;
        relations[i] = relation_of(view, *added[i], sequence.camera);
        query.has_positive |= relations[i] == Relation::same;
        query.has_negative |= relations[i] == Relation::different;
      }
      for (const PlaceCandidate& c : query.candidates) query.relations.push_back(relations[c.keyframe.value]);
      if (query.has_positive || query.has_negative) queries.push_back(std::move(query));
      index->add(KeyframeId{static_cast<std::uint32_t>(added.size())}, view.descriptors);
      added.push_back(&view);
    }
  }
  return queries;
}

double recall_within(const std::vector<Query>& queries, std::size_t k) {
  std::size_t findable = 0, found = 0;
  for (const Query& query : queries) {
    findable += query.has_positive ? 1 : 0;
    found += query.has_positive && query.found_within(k) ? 1 : 0;
  }
  return findable > 0 ? static_cast<double>(found) / static_cast<double>(findable) : 0.0;
}

std::string curves_csv(const std::vector<NamedCurve>& curves) {
  std::string csv = "method,threshold,precision,recall\n";
  for (const NamedCurve& curve : curves) {
    for (const PrecisionRecallPoint& p : curve.points) {
      csv += fmt::format("{},{:.9g},{:.6f},{:.6f}\n", curve.name, p.threshold, p.precision, p.recall);
    }
  }
  return csv;
}

Json curve_json(const NamedCurve& curve) {
  return {{"method", curve.name},
          {"recall_at_precision_1", recall_at_full_precision(curve.points)},
          {"average_precision", average_precision(curve.points)}};
}

void bench_places(BenchPlacesOptions options) {
  for (const std::string& setting : options.index_settings) set_option(options.index, setting);
  make_folder(options.output);
  install_interrupt_handler();
  std::vector<SequenceViews> sequences;
  for (const fs::path& folder : options.sequences) {
    sequences.push_back(read_views(options, folder, sequences.size()));
  }
  const std::vector<Query> queries = ask(options, sequences);
  if (interrupted()) {
    log().warn("interrupted, nothing is written");
    exit_code() = kInterrupted;
    return;
  }
  std::vector<RetrievalOutcome> outcomes;
  std::vector<double> times;
  for (const Query& query : queries) {
    outcomes.push_back(query.outcome());
    times.push_back(query.milliseconds);
  }
  const std::vector<NamedCurve> curves = {{"retrieval", precision_recall(outcomes)}};
  if (curves.front().points.empty()) {
    throw UserError(
        fmt::format("no place is seen twice more than {:g} s apart; try a smaller --gap", options.gap));
  }
  const auto findable = std::count_if(outcomes.begin(), outcomes.end(),
                                      [](const RetrievalOutcome& o) { return o.has_positive; });
  const Statistics time = run_statistics(times);
  Json json = {
      {"version", kVersion}, {"gap", options.gap}, {"every", options.every}, {"together", options.together}};
  for (const SequenceViews& s : sequences) {
    json["sequences"].push_back({{"folder", s.name}, {"frames", s.views.size()}});
  }
  json["settings"] = options_json(option_table(options.index));
  json["queries"] = queries.size();
  json["queries_with_positive"] = findable;
  for (const std::size_t k : {1, 5, 10}) json[fmt::format("recall_at_{}", k)] = recall_within(queries, k);
  for (const NamedCurve& curve : curves) json["curves"].push_back(curve_json(curve));
  write_file_atomically(options.output / "places.json", json_text(json));
  write_file_atomically(options.output / "places.csv", curves_csv(curves));
  write_precision_recall_plot(options.output / "places.png", curves,
                              fmt::format("Place recognition, {} queries", queries.size()));
  fmt::print("{} queries, {} with a place to find\n", queries.size(), findable);
  fmt::print(
      "  retrieval: recall@1 {:.3f}, @5 {:.3f}, @10 {:.3f}; {:.3f} ms per lookup (median; longest {:.3f})\n",
      recall_within(queries, 1), recall_within(queries, 5), recall_within(queries, 10), time.median,
      time.max);
  for (const NamedCurve& curve : curves) {
    fmt::print("  {}: recall {:.3f} at precision 1, average precision {:.3f}\n", curve.name,
               recall_at_full_precision(curve.points), average_precision(curve.points));
  }
}

}  // namespace

void add_bench_places(CLI::App& bench) {
  auto* verb = bench.add_subcommand(
      "places", "Precision and recall of place recognition on sequences with ground truth");
  auto o = std::make_shared<BenchPlacesOptions>();
  verb->add_option("sequences", o->sequences, "Folders in TUM RGB-D layout with groundtruth.txt")
      ->type_name("SEQUENCE")
      ->check(not_empty())
      ->required();
  verb->add_option("-o,--output", o->output,
                   "Folder for places.json, places.csv and places.png, made if need be")
      ->type_name("OUT_DIR")
      ->check(not_empty())
      ->required();
  verb->add_option("--gap", o->gap, "Frames closer in time are not compared, seconds")
      ->type_name("S")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  verb->add_option("--every", o->every, "Take every so many frames")
      ->type_name("N")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  verb->add_flag("--together", o->together,
                 "One index for all sequences, which must show different places: what another sequence shows "
                 "is wrong");
  verb->add_option("--index", o->index_settings, "A setting of the index, KEY=VALUE")->type_name("KEY=VALUE");
  verb->add_option("--camera", o->settings.camera, "As for 'run'; for all sequences")->type_name("NAME|FILE");
  o->settings.add_settings_to(*verb);
  o->segmenter.add_to(*verb);
  verb->callback([o] { bench_places(*o); });
}

}  // namespace ipl_slam::cli
