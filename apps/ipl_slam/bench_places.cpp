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
#include "loop/place_verifier.hpp"
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
  std::shared_ptr<const Frame> frame;
  FeatureTrust trust;                   // 0 for what may move by itself
  std::vector<Descriptor> descriptors;  // of the others
};

struct SequenceViews {
  std::string name;
  Camera camera;
  Config config;
  std::vector<View> views;
};

enum class Relation { same, different, unclear };

// An answer that was checked by geometry.
struct Verified {
  int inliers = 0;
  double error = 0.0;  // of the position, m
  Relation relation = Relation::unclear;
};

// What is known of one query.
struct Query {
  std::vector<PlaceCandidate> candidates;
  std::vector<Relation> relations;  // of the candidates
  std::optional<Verified> verified;
  bool has_positive = false, has_negative = false;
  double milliseconds = 0.0;

  [[nodiscard]] RetrievalOutcome retrieval() const {
    const auto answer = std::find_if(relations.begin(), relations.end(),
                                     [](Relation relation) { return relation != Relation::unclear; });
    if (answer == relations.end()) return {has_positive, {}, false};
    const auto rank = static_cast<std::size_t>(answer - relations.begin());
    return {has_positive, candidates[rank].score, *answer == Relation::same};
  }
  [[nodiscard]] RetrievalOutcome verification() const {
    if (!verified) return {has_positive, {}, false};
    return {has_positive, verified->inliers, verified->relation == Relation::same};
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

View make_view(std::size_t sequence, const RgbdFrame& image, Features features, const BitMask& moving,
               DepthView depth) {
  View view{sequence, image.timestamp, std::move(depth), {}, {}, {}};
  for (std::size_t i = 0; i < features.size(); ++i) {
    const bool moves = covers(moving, features.keypoints[i].pixel.cast<double>());
    view.trust.weights.push_back(moves ? 0.0 : 1.0);
    if (!moves) view.descriptors.push_back(features.descriptors[i]);
  }
  view.trust.regions.resize(features.size());
  const FeatureGrid grid(features);
  view.frame = std::make_shared<const Frame>(Frame{image.index, image.timestamp, std::move(features), grid});
  return view;
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
  SequenceViews sequence{folder.lexically_normal().string(), settings.load_camera(), config, {}};
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
    sequence.views.push_back(make_view(number, frame, extractor.extract(frame.color, frame.depth), moving,
                                       make_depth_view(frame.depth, *T_wc, sequence.camera, moving)));
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

// A map of the views at their true poses, in which candidates are verified. Keyframes get the ids 0, 1, ...
class TrueMap {
 public:
  explicit TrueMap(const Config& config) : map_(ScalePyramid(config.orb.levels, config.orb.scale_factor)) {}

  // What the frame before it saw is observed again where it shows; every other keypoint with depth is a new
  // point.
  void add(const View& view, const SequenceViews& sequence, bool first_of_sequence) {
    const SE3 T_cw = view.depth.T_wc.inverse();
    const KeyframeId before = map_.newest_keyframe();
    std::vector<PointId> points(view.frame->features.size());
    if (!first_of_sequence) {
      const GuidedSearch search(sequence.camera, map_.pyramid(), sequence.config.depth, {},
                                sequence.config.tracking.pose);
      constexpr double radius = 4.0;  // pixels; the poses are good to one or two
      points = search.place(map_, {*view.frame, view.trust}, landmarks_around(map_, before, 0), T_cw, radius)
                   .points;
    }
    const PartId part = first_of_sequence ? map_.new_part() : map_.part_of(before);
    const KeyframeId id = map_.add_keyframe(view.frame, T_cw, nullptr, view.trust, {}, part);
    for (std::uint32_t k = 0; k < points.size(); ++k) {
      const Keypoint& keypoint = view.frame->features.keypoints[k];
      if (view.trust.weight(k) <= 0.0) continue;
      if (points[k].valid()) {
        map_.add_observation(points[k], id, k);
        map_.refresh(points[k]);
      } else if (keypoint.depth > 0.0F) {
        const Eigen::Vector3d p_c =
            sequence.camera.unproject(keypoint.undistorted.cast<double>(), keypoint.depth);
        map_.refresh(map_.add_point(view.depth.T_wc * p_c, id, k));
      }
    }
  }

  // The first candidate that geometry accepts, those left out that are neither right nor wrong.
  [[nodiscard]] std::optional<Verified> verify(const View& view, const SequenceViews& sequence,
                                               const Query& query) const {
    const PlaceVerifier verifier(sequence.camera, map_.pyramid(), sequence.config.depth, {},
                                 sequence.config.tracking.pose);
    for (std::size_t i = 0; i < query.candidates.size(); ++i) {
      if (query.relations[i] == Relation::unclear) continue;
      const auto match = verifier.verify(map_, {*view.frame, view.trust}, query.candidates[i].keyframe);
      if (!match) continue;
      const SE3 T_wc = match->T_cw.inverse();
      return Verified{match->inliers, (T_wc.translation() - view.depth.T_wc.translation()).norm(),
                      query.relations[i]};
    }
    return std::nullopt;
  }

 private:
  Map map_;
};

// Asks for each view among those before it, then adds it.
std::vector<Query> ask(const BenchPlacesOptions& options, const std::vector<SequenceViews>& sequences) {
  std::size_t total = 0;
  for (const SequenceViews& sequence : sequences) total += sequence.views.size();
  std::optional<ProgressBar> bar;
  if (says_remarks()) bar.emplace("queries", total);
  std::vector<Query> queries;
  std::vector<const View*> added;  // by keyframe id
  std::optional<PlaceIndex> index;
  std::optional<TrueMap> map;
  for (const SequenceViews& sequence : sequences) {
    if (!index || !options.together) {
      index.emplace(options.index);
      map.emplace(sequence.config);
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
      query.verified = map->verify(view, sequence, query);
      if (query.has_positive || query.has_negative) queries.push_back(std::move(query));
      index->add(KeyframeId{static_cast<std::uint32_t>(added.size())}, view.descriptors);
      map->add(view, sequence, &view == &sequence.views.front());
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
  std::vector<RetrievalOutcome> retrieved, verified;
  std::vector<double> times, errors;
  for (const Query& query : queries) {
    retrieved.push_back(query.retrieval());
    verified.push_back(query.verification());
    times.push_back(query.milliseconds);
    if (verified.back().correct) errors.push_back(query.verified->error);
  }
  const std::vector<NamedCurve> curves = {{"retrieval", precision_recall(retrieved)},
                                          {"retrieval and verification", precision_recall(verified)}};
  const auto findable =
      std::count_if(queries.begin(), queries.end(), [](const Query& query) { return query.has_positive; });
  if (findable == 0) {
    throw UserError(
        fmt::format("no place is seen twice more than {:g} s apart; try a smaller --gap", options.gap));
  }
  const Statistics time = run_statistics(times), error = error_statistics(errors);
  Json json = {
      {"version", kVersion}, {"gap", options.gap}, {"every", options.every}, {"together", options.together}};
  for (const SequenceViews& s : sequences) {
    json["sequences"].push_back({{"folder", s.name}, {"frames", s.views.size()}});
  }
  json["settings"] = options_json(option_table(options.index));
  json["queries"] = queries.size();
  json["queries_with_positive"] = findable;
  json["lookup_ms"] = {{"median", time.median}, {"max", time.max}};
  json["position_error_m"] = {{"median", error.median}, {"max", error.max}};
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
  fmt::print("  verified places: position off by {:.3f} m (median; largest {:.3f})\n", error.median,
             error.max);
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
