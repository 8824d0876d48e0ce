#include "bench_places.hpp"

#include <algorithm>
#include <filesystem>
#include <limits>
#include <memory>
#include <numbers>
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
#include "dataset/prefetching_source.hpp"
#include "evaluation/precision_recall_plot.hpp"
#include "evaluation/statistics.hpp"
#include "evaluation/view_overlap.hpp"
#include "features/orb_extractor.hpp"
#include "loop/place_index.hpp"
#include "loop/place_verifier.hpp"
#include "mapped_sequence.hpp"
#include "output.hpp"
#include "segmentation/make_segmenter.hpp"
#include "segmenter_choice.hpp"
#include "sequence_input.hpp"
#include "sequence_options.hpp"
#include "verbs.hpp"

namespace ipl_slam::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// Two views show one place when either sees so much of the other, and different ones below the second share.
constexpr double kPositiveShare = 0.5, kNegativeShare = 0.1;

// A view is where it was said to be when its pose relative to the keyframe is true to this: some times the
// error of the truth (Sturm et al., IROS 2012: 1 cm, 0.5 degrees) and of its time.
constexpr double kMaxError = 0.1;       // m
constexpr double kMaxErrorAngle = 5.0;  // degrees

struct BenchPlacesOptions {
  std::vector<fs::path> sequences;
  fs::path output;
  SequenceOptions settings;
  SegmenterChoice segmenter;
  double gap = 5.0;
  int every = 1;
  bool together = false;
};

// A frame with a true pose.
struct View {
  double timestamp = 0.0;
  DepthView depth;
  Frame frame;
  FeatureTrust trust;                   // 0 for what may move by itself
  std::vector<Descriptor> descriptors;  // of the others
};

enum class Relation { same, different, unclear };

const char* to_string(Relation relation) {
  return relation == Relation::same ? "same" : relation == Relation::different ? "different" : "unclear";
}

// Where a view was said to be, and whether it is there.
struct Answer {
  PlaceMatch match;
  std::size_t known_frame = 0;            // the keyframe's
  Relation relation = Relation::unclear;  // of the view and the keyframe
  double error = 0.0, error_angle = 0.0;  // of the pose, m and degrees; infinite in another sequence
  [[nodiscard]] bool right() const { return error <= kMaxError && error_angle <= kMaxErrorAngle; }
};

// What is known of one query.
struct Query {
  std::size_t sequence = 0, frame = 0;
  std::vector<double> scores;        // of the candidates
  std::vector<Relation> relations;   // the same
  std::vector<Answer> verified;      // of the candidates, those that geometry accepts
  std::optional<Answer> recognised;  // by the loop closer
  bool has_positive = false, has_negative = false;
  double milliseconds = 0.0;

  [[nodiscard]] RetrievalOutcome retrieval() const {
    const auto answer = std::find_if(relations.begin(), relations.end(),
                                     [](Relation relation) { return relation != Relation::unclear; });
    if (answer == relations.end()) return {has_positive, {}, false};
    const auto rank = static_cast<std::size_t>(answer - relations.begin());
    return {has_positive, scores[rank], *answer == Relation::same};
  }
  [[nodiscard]] RetrievalOutcome verification() const {
    const auto best =
        std::max_element(verified.begin(), verified.end(),
                         [](const Answer& a, const Answer& b) { return a.match.inliers < b.match.inliers; });
    return best == verified.end() ? RetrievalOutcome{has_positive, {}, false} : outcome(*best);
  }
  [[nodiscard]] RetrievalOutcome recognition() const {
    return recognised ? outcome(*recognised) : RetrievalOutcome{has_positive, {}, false};
  }
  [[nodiscard]] bool found_within(std::size_t k) const {
    const auto end = relations.begin() + static_cast<std::ptrdiff_t>(std::min(k, relations.size()));
    return std::find(relations.begin(), end, Relation::same) != end;
  }

 private:
  // A right answer where nothing had to be found is neither for nor against.
  [[nodiscard]] RetrievalOutcome outcome(const Answer& answer) const {
    if (answer.right() && !has_positive) return {false, {}, false};
    return {has_positive, answer.match.inliers, answer.right()};
  }
};

BitMask moving_in(const RgbdFrame& frame, Segmenter* segmenter) {
  BitMask moving(frame.color.size());
  if (segmenter == nullptr) return moving;
  for (const Instance& instance : segmenter->segment(frame)) {
    if (may_walk_off(instance)) moving |= instance.mask;
  }
  return moving;
}

View make_view(const RgbdFrame& image, Features features, const BitMask& moving, DepthView depth) {
  FeatureGrid grid(features);
  View view{image.timestamp,
            std::move(depth),
            {image.index, image.timestamp, std::move(features), std::move(grid)},
            {},
            {}};
  for (std::size_t i = 0; i < view.frame.features.size(); ++i) {
    const bool moves = covers(moving, view.frame.features.keypoints[i].pixel.cast<double>());
    view.trust.weights.push_back(moves ? 0.0 : 1.0);
    if (!moves) view.descriptors.push_back(view.frame.features.descriptors[i]);
  }
  view.trust.regions.resize(view.frame.features.size());
  return view;
}

// A relative folder of masks is looked for in the sequence first.
SegmenterChoice masks_of(SegmenterChoice choice, const fs::path& sequence) {
  std::error_code ignored;
  if (!choice.masks.empty() && fs::is_directory(sequence / choice.masks, ignored)) {
    choice.masks = sequence / choice.masks;
  }
  return choice;
}

Relation relation_of(const DepthView& a, const DepthView& b, const Camera& camera) {
  const auto judge = [](double share) {
    if (share >= kPositiveShare) return Relation::same;
    return share < kNegativeShare ? Relation::different : Relation::unclear;
  };
  const Relation relation = judge(seen_share(a, b, camera));
  if (relation == Relation::unclear || judge(seen_share(b, a, camera)) != relation) return Relation::unclear;
  return relation;
}

// A sequence, asked for the place of its views among what was mapped of it before.
struct Sequence {
  Sequence(const BenchPlacesOptions& options, const fs::path& folder)
      : name(folder.lexically_normal().string()) {
    SequenceOptions settings = options.settings;
    settings.folder = folder;
    config = settings.load_config();
    masks_of(options.segmenter, folder).apply(config);
    camera = settings.load_camera();
    auto dataset = std::make_unique<TumDataset>(folder, camera);
    std::optional<Trajectory> trajectory = read_ground_truth(*dataset);
    if (!trajectory) {
      throw UserError(fmt::format("'{}' has no usable groundtruth.txt, which this measure needs", name));
    }
    truth = std::make_unique<TruePoses>(std::move(*trajectory));
    mapped = std::make_unique<MappedSequence>(camera, config, std::move(dataset), *truth);
  }

  std::string name;
  Camera camera;
  Config config;
  std::unique_ptr<TruePoses> truth;
  std::unique_ptr<MappedSequence> mapped;
  std::size_t views = 0;
};

// Asks each view for its place among what was mapped before it.
class Examination {
 public:
  explicit Examination(const BenchPlacesOptions& options) : options_(options) {}

  void add_sequence(const fs::path& folder) {
    if (!options_.together) index_.reset();
    if (!index_) known_.clear();
    sequences_.push_back(std::make_unique<Sequence>(options_, folder));
    Sequence& sequence = *sequences_.back();
    if (!index_) index_.emplace(sequence.config.loops.index);
    const std::unique_ptr<Segmenter> segmenter =
        make_segmenter(sequence.config.segmentation, sequence.camera, sequence.config.schedule.seed);
    OrbExtractor extractor(sequence.config.orb, sequence.camera, sequence.config.depth);
    PrefetchingSource source(std::make_unique<TumDataset>(folder, sequence.camera));
    const std::size_t limit = options_.settings.max_frames > 0 ? options_.settings.max_frames : source.size();
    std::optional<ProgressBar> bar;
    if (says_remarks()) bar.emplace(folder.filename().string(), std::min(limit, source.size()));
    for (std::size_t count = 0; count < limit && !interrupted(); ++count) {
      const std::optional<SourceItem> item = source.next();
      if (!item) break;
      if (bar) bar->advance(1);
      if (!item->frame || count % static_cast<std::size_t>(options_.every) != 0) continue;
      const RgbdFrame& frame = *item->frame;
      const std::optional<SE3> T_wc = sequence.truth->at(frame.timestamp);
      if (!T_wc) continue;
      const BitMask moving = moving_in(frame, segmenter.get());
      ask(make_view(frame, extractor.extract(frame.color, frame.depth), moving,
                    make_depth_view(frame.depth, *T_wc, sequence.camera, moving)));
    }
    if (options_.together) learn(std::numeric_limits<double>::infinity());
  }

  [[nodiscard]] const std::vector<std::unique_ptr<Sequence>>& sequences() const { return sequences_; }
  [[nodiscard]] const std::vector<Query>& queries() const { return queries_; }

 private:
  // A keyframe in the index, whose ids are those of the places.
  struct Place {
    std::size_t sequence = 0;
    KeyframeId keyframe;
  };

  // What the present sequence showed before `timestamp` is known from now on.
  void learn(double timestamp) {
    Sequence& sequence = *sequences_.back();
    sequence.mapped->advance(timestamp);
    sequence.mapped->read([&](const Map& map) {
      map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
        const bool known = !known_.empty() && known_.back().sequence == sequences_.size() - 1 &&
                           id <= known_.back().keyframe;
        if (known) return;
        index_->add(KeyframeId{static_cast<std::uint32_t>(known_.size())},
                    static_descriptors(view_of(keyframe)));
        known_.push_back({sequences_.size() - 1, id});
      });
    });
  }

  void ask(const View& view) {
    Sequence& sequence = *sequences_.back();
    ++sequence.views;
    learn(view.timestamp - options_.gap);
    Query query;
    query.sequence = sequences_.size() - 1;
    query.frame = view.frame.index;
    std::vector<Relation> relations;
    std::vector<bool> eligible;
    for (const Place& place : known_) {
      with_keyframe(place, [&](const Map&, const Keyframe* keyframe) {
        eligible.push_back(keyframe != nullptr);
        relations.push_back(keyframe ? relation(view, place, *keyframe) : Relation::unclear);
      });
      query.has_positive |= relations.back() == Relation::same;
      query.has_negative |= relations.back() == Relation::different;
    }
    if (!query.has_positive && !query.has_negative) return;

    const Stopwatch stopwatch;
    const std::vector<PlaceCandidate> candidates =
        index_->query(view.descriptors, [&](KeyframeId id) { return eligible[id.value]; });
    query.milliseconds = stopwatch.milliseconds();
    const PlaceView asked{view.frame, view.trust};
    const PlaceVerifier verifier(sequence.camera,
                                 ScalePyramid(sequence.config.orb.levels, sequence.config.orb.scale_factor),
                                 sequence.config.depth, sequence.config.loops.verifier,
                                 sequence.config.tracking.pose, sequence.config.schedule.seed);
    for (const PlaceCandidate& candidate : candidates) {
      const Place& place = known_[candidate.keyframe.value];
      query.scores.push_back(candidate.score);
      query.relations.push_back(relations[candidate.keyframe.value]);
      with_keyframe(place, [&](const Map& map, const Keyframe*) {
        auto match = verifier.verify(map, asked, place.keyframe);
        if (match) query.verified.push_back(judge(view, place.sequence, map, std::move(*match)));
      });
    }
    for (std::size_t s = known_.empty() ? sequences_.size() : known_.front().sequence; s < sequences_.size();
         ++s) {
      auto match = sequences_[s]->mapped->find(asked);
      if (!match || (query.recognised && match->inliers <= query.recognised->match.inliers)) continue;
      sequences_[s]->mapped->read(
          [&](const Map& map) { query.recognised = judge(view, s, map, std::move(*match)); });
    }
    queries_.push_back(std::move(query));
  }

  // Calls fn(map, keyframe); null where the keyframe was taken out of the map.
  template <class Fn>
  void with_keyframe(const Place& place, Fn&& fn) const {
    sequences_[place.sequence]->mapped->read([&](const Map& map) {
      fn(map, map.keyframes().contains(place.keyframe) ? &map.keyframes()[place.keyframe] : nullptr);
    });
  }

  [[nodiscard]] Relation relation(const View& view, const Place& place, const Keyframe& keyframe) const {
    if (place.sequence != sequences_.size() - 1) return Relation::different;
    const DepthView* seen = sequences_.back()->mapped->seen_by(keyframe);
    return seen ? relation_of(view.depth, *seen, sequences_.back()->camera) : Relation::unclear;
  }

  [[nodiscard]] Answer judge(const View& view, std::size_t sequence, const Map& map, PlaceMatch match) const {
    const Keyframe& keyframe = map.keyframes()[match.keyframe];
    Answer answer{std::move(match), keyframe.frame->index};
    answer.relation = relation(view, {sequence, answer.match.keyframe}, keyframe);
    answer.error = answer.error_angle = std::numeric_limits<double>::infinity();
    const DepthView* seen = sequences_[sequence]->mapped->seen_by(keyframe);
    if (sequence != sequences_.size() - 1 || !seen) return answer;
    const SE3 found = answer.match.T_cw * keyframe.T_cw.inverse();
    const SE3 error = found * (seen->T_wc.inverse() * view.depth.T_wc);
    answer.error = error.translation().norm();
    answer.error_angle = error.angle() * 180.0 / std::numbers::pi;
    return answer;
  }

  BenchPlacesOptions options_;
  std::vector<std::unique_ptr<Sequence>> sequences_;
  std::optional<PlaceIndex> index_;
  std::vector<Place> known_;  // by id in the index
  std::vector<Query> queries_;
};

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

std::string matches_csv(const std::vector<Query>& queries) {
  std::string csv =
      "sequence,frame,findable,known_frame,relation,inliers,line_inliers,found_share,cells,deviation,error_m,"
      "error_deg\n";
  for (const Query& query : queries) {
    for (const Answer& a : query.verified) {
      csv += fmt::format("{},{},{:d},{},{},{},{},{:.4f},{},{:.5f},{:.4f},{:.3f}\n", query.sequence,
                         query.frame, query.has_positive, a.known_frame, to_string(a.relation),
                         a.match.inliers, a.match.line_inliers, a.match.found_share, a.match.cells,
                         a.match.deviation, a.error, a.error_angle);
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
  make_folder(options.output);
  install_interrupt_handler();
  Examination examination(options);
  for (const fs::path& folder : options.sequences) examination.add_sequence(folder);
  const std::vector<Query>& queries = examination.queries();
  if (interrupted()) {
    log().warn("interrupted, nothing is written");
    exit_code() = kInterrupted;
    return;
  }
  std::vector<RetrievalOutcome> retrieved, verified, recognised;
  std::vector<double> times, errors;
  for (const Query& query : queries) {
    retrieved.push_back(query.retrieval());
    verified.push_back(query.verification());
    recognised.push_back(query.recognition());
    times.push_back(query.milliseconds);
    if (recognised.back().correct) errors.push_back(query.recognised->error);
  }
  const std::vector<NamedCurve> curves = {
      {"retrieval", precision_recall(retrieved)},
      {"retrieval + verification", precision_recall(verified)},
      {"retrieval + verification + rivals", precision_recall(recognised)}};
  const auto findable =
      std::count_if(queries.begin(), queries.end(), [](const Query& query) { return query.has_positive; });
  if (findable == 0) {
    throw UserError(
        fmt::format("no place is seen twice more than {:g} s apart; try a smaller --gap", options.gap));
  }
  const Statistics time = run_statistics(times), error = error_statistics(errors);
  Json json = {
      {"version", kVersion}, {"gap", options.gap}, {"every", options.every}, {"together", options.together}};
  for (const auto& s : examination.sequences()) {
    json["sequences"].push_back({{"folder", s->name}, {"frames", s->views}});
  }
  json["queries"] = queries.size();
  json["queries_with_positive"] = findable;
  json["lookup_ms"] = {{"median", time.median}, {"max", time.max}};
  json["position_error_m"] = {{"median", error.median}, {"max", error.max}};
  for (const std::size_t k : {1, 5, 10}) json[fmt::format("recall_at_{}", k)] = recall_within(queries, k);
  for (const NamedCurve& curve : curves) json["curves"].push_back(curve_json(curve));
  write_file_atomically(options.output / "places.json", json_text(json));
  write_file_atomically(options.output / "places.csv", curves_csv(curves));
  write_file_atomically(options.output / "matches.csv", matches_csv(queries));
  write_precision_recall_plot(options.output / "places.png", curves,
                              fmt::format("Place recognition, {} queries", queries.size()));
  fmt::print("{} queries, {} with a place to find\n", queries.size(), findable);
  fmt::print(
      "  retrieval: recall@1 {:.3f}, @5 {:.3f}, @10 {:.3f}; {:.3f} ms per lookup (median; longest {:.3f})\n",
      recall_within(queries, 1), recall_within(queries, 5), recall_within(queries, 10), time.median,
      time.max);
  for (const NamedCurve& curve : curves) {
    // Recall at precision 1 takes the best threshold in hindsight; the last point is what the settings
    // accept.
    const PrecisionRecallPoint all = curve.points.empty() ? PrecisionRecallPoint{} : curve.points.back();
    fmt::print(
        "  {}: recall {:.3f} at precision 1, average precision {:.3f}; as set: precision {:.3f}, recall "
        "{:.3f}\n",
        curve.name, recall_at_full_precision(curve.points), average_precision(curve.points), all.precision,
        all.recall);
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
                   "Folder for places.json, places.csv, matches.csv and places.png, made if need be")
      ->type_name("OUT_DIR")
      ->check(not_empty())
      ->required();
  verb->add_option("--gap", o->gap,
                   "What a frame is looked for in is what was mapped until so many seconds before it")
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
  verb->add_option("--camera", o->settings.camera, "As for 'run'; for all sequences")->type_name("NAME|FILE");
  o->settings.add_settings_to(*verb);
  o->settings.add_max_frames_to(*verb);
  o->segmenter.add_to(*verb);
  verb->callback([o] { bench_places(*o); });
}

}  // namespace ipl_slam::cli
