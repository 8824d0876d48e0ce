#include "dynamics/contour_window.hpp"

#include <algorithm>
#include <cstdlib>
#include <numeric>
#include <stdexcept>

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

#include "dynamics/shape_similarity.hpp"
#include "segmentation/class_role.hpp"

namespace ipl_slam {
namespace {

std::vector<TrackedInstance> evidence(const std::vector<TrackedInstance>& instances) {
  std::vector<TrackedInstance> seen;
  for (const TrackedInstance& tracked : instances) {
    if (tracked.frames_carried == 0 && !tracked.instance.mask.none()) seen.push_back(tracked);
  }
  return seen;
}

std::optional<std::size_t> index_of(const InstanceView& view, InstanceId id) {
  for (std::size_t i = 0; i < view.instances.size(); ++i) {
    if (view.instances[i].id == id) return i;
  }
  return std::nullopt;
}

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

// The median without the lowest two: a bad mask spoils two pairs, the one it ends and the one it begins.
double robust_mean_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  values.erase(values.begin(),
               values.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(2, values.size() - 1)));
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 == 1 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

}  // namespace

ContourWindowOptions paper_contour_window() {
  ContourWindowOptions options;
  options.tolerance = 0;
  options.sparse_window = 0;
  options.threshold = 0.85;
  options.movable_threshold = 0.85;
  options.iou_weight = 0.5;
  options.robust = false;
  options.compensate = false;
  options.record_table = false;
  return options;
}

void check(const ContourWindowOptions& options) {
  if (options.pair_gap > options.window) {
    throw UserError(
        fmt::format("contours.pair_gap ({}) is above contours.window ({}), so no pair fits in; lower the one "
                    "or raise the other",
                    options.pair_gap, options.window));
  }
  // A pair ends in each frame from the gap to the end of the window; first and last mask make one more.
  const int most = options.window - options.pair_gap + (options.pair_gap < options.window ? 2 : 1);
  if (options.minimum_pairs > most) {
    throw UserError(fmt::format(
        "contours.minimum_pairs ({}) is above the {} that a window of {} frames holds at contours.pair_gap = "
        "{}; lower it, or raise contours.window",
        options.minimum_pairs, most, options.window, options.pair_gap));
  }
}

ContourVerdict ContourVerdicts::of(InstanceId id) const {
  const auto found =
      std::find_if(verdicts.begin(), verdicts.end(), [&](const ContourVerdict& v) { return v.id == id; });
  return found != verdicts.end() ? *found : ContourVerdict{id, MotionState::kCandidate, std::nullopt};
}

ContourWindow::ContourWindow(const Camera& camera, const ContourWindowOptions& options)
    : options_(options),
      depth_scale_(camera.depth_scale),
      carried_(camera, options.carried),
      window_(static_cast<std::size_t>(options.window)),
      sparse_window_(static_cast<std::size_t>(options.sparse_window)),
      movers_(window_, static_cast<std::size_t>(options.forget_after)) {}

ContourVerdicts ContourWindow::process(const ContourFrame& frame) {
  if (last_frame_ && frame.index <= *last_frame_) {
    throw std::invalid_argument("ContourWindow::process: frames must be given in order");
  }
  views_.push_back(
      {frame.index, InstanceView(evidence(frame.instances), frame.depth, frame.T_wc, depth_scale_)});
  forget_old(frame.index);

  ContourVerdicts result;
  for (const TrackedInstance& tracked : frame.instances) {
    Track& track = track_of(tracked.id, frame.index);
    const bool known_mover = movers_.contains(tracked.id);
    const std::optional<std::size_t> instance = index_of(views_.back().seen, tracked.id);
    std::size_t first_dynamic = frame.index;  // that of a known mover is about the new mask
    if (known_mover) track.verdict.state = MotionState::kMoving;
    if (instance && known_mover) check_known_mover(track, *instance);
    if (instance && !known_mover) first_dynamic = judge(track, *instance).value_or(frame.index);

    result.verdicts.push_back(track.verdict);
    if (track.verdict.state == MotionState::kMoving) {
      result.dynamic.push_back({tracked.id, first_dynamic, frame.index});
    }
  }
  last_frame_ = frame.index;
  if (views_.back().seen.instances.empty()) views_.pop_back();
  return result;
}

// Who was away for longer than a window starts anew. Between two frames given one after the other nobody was
// away, unless they are too far apart to be compared.
ContourWindow::Track& ContourWindow::track_of(InstanceId id, std::size_t now) {
  const Track new_track{now, now, {}, {id, MotionState::kCandidate, {}}};
  Track& track = tracks_.try_emplace(id, new_track).first->second;
  const std::size_t longest_absence =
      track.last_seen == last_frame_ ? std::max(window_, sparse_window_) : window_;
  if (now - track.last_seen > longest_absence) track = new_track;
  track.last_seen = now;
  movers_.saw(id, now);
  return track;
}

std::optional<std::size_t> ContourWindow::judge(Track& track, std::size_t instance) {
  const std::size_t now = views_.back().frame;
  std::optional<Pair> pair, ends;
  const View* earlier = find_earlier(track, options_.pair_gap, now);
  const View* start = find_earlier(track, options_.window, earlier != nullptr ? earlier->frame : now);
  if (earlier != nullptr) pair = compare(*earlier, instance);
  if (start != nullptr) ends = compare(*start, instance);
  if (pair) {
    // A young track has nothing but its first mask to compare with; that one must not have many votes.
    if (!track.pairs.empty() && track.pairs.back().earlier == pair->earlier) track.pairs.pop_back();
    track.pairs.push_back(*pair);
  }
  // What stays are the pairs that lie inside the window as a whole, and where these are too few, older ones.
  const auto enough = static_cast<std::size_t>(options_.minimum_pairs);
  const std::size_t span = window_ - std::min(window_, static_cast<std::size_t>(options_.pair_gap));
  const auto stays = [&](const Pair& oldest) {
    if (oldest.later + span >= now) return true;
    return track.pairs.size() + (ends ? 1 : 0) <= enough && oldest.earlier + sparse_window_ >= now;
  };
  while (!track.pairs.empty() && !stays(track.pairs.front())) track.pairs.pop_front();

  std::vector<double> similarities;
  for (const Pair& p : track.pairs) similarities.push_back(p.similarity);
  if (ends) similarities.push_back(ends->similarity);
  // With too few the last verdict stands.
  if (similarities.size() < enough) return std::nullopt;
  std::size_t first = now - std::min(now, window_);
  if (!track.pairs.empty()) first = std::min(first, track.pairs.front().earlier);
  const double similarity = options_.robust ? robust_mean_of(similarities) : mean_of(similarities);
  const bool moving = similarity < threshold_of(instance);
  track.verdict.similarity = similarity;
  track.verdict.state = moving ? MotionState::kMoving : MotionState::kStill;
  if (moving && options_.record_table) {
    movers_.add(track.verdict.id, now);
    track.pairs.clear();
  }
  return std::max(first, track.first_seen);
}

void ContourWindow::check_known_mover(Track& track, std::size_t instance) {
  const std::size_t now = views_.back().frame;
  if (now - movers_.last_check(track.verdict.id) < static_cast<std::size_t>(options_.pair_gap)) return;
  const View* earlier = find_earlier(track, options_.pair_gap, now);
  const std::optional<Pair> pair = earlier != nullptr ? compare(*earlier, instance) : std::nullopt;
  if (!pair) return;
  track.verdict.similarity = pair->similarity;
  movers_.check(track.verdict.id, pair->earlier, now, pair->similarity >= threshold_of(instance));
  if (!movers_.contains(track.verdict.id)) track.verdict.state = MotionState::kStill;
}

const ContourWindow::View* ContourWindow::find_earlier(const Track& track, int gap, std::size_t end) const {
  const std::size_t now = views_.back().frame;
  const View *nearest = nullptr, *before = nullptr;
  int least_difference = options_.tolerance + 1;
  for (const View& view : views_) {
    if (view.frame < track.first_seen || view.frame >= end || !index_of(view.seen, track.verdict.id))
      continue;
    const int difference = static_cast<int>(now - view.frame) - gap;
    if (std::abs(difference) < least_difference) {
      nearest = &view;
      least_difference = std::abs(difference);
    }
    if (difference > options_.tolerance && view.frame + sparse_window_ >= now) before = &view;
  }
  return nearest != nullptr ? nearest : before;
}

std::optional<ContourWindow::Pair> ContourWindow::compare(const View& earlier, std::size_t instance) const {
  const View& now = views_.back();
  const std::size_t before = *index_of(earlier.seen, now.seen.instances[instance].id);
  if (!options_.compensate) {
    return Pair{earlier.frame, now.frame,
                shape_similarity(earlier.seen.instances[before].instance.mask,
                                 now.seen.instances[instance].instance.mask, options_.iou_weight)};
  }
  const auto shapes = carried_.compare(earlier.seen, before, now.seen, instance);
  if (!shapes) return std::nullopt;
  return Pair{
      earlier.frame, now.frame,
      shape_similarity(shapes->iou, hu_similarity(shapes->earlier, shapes->later), options_.iou_weight)};
}

double ContourWindow::threshold_of(std::size_t instance) const {
  const std::string& name = views_.back().seen.instances[instance].instance.class_name;
  return class_role(name) == ClassRole::likely_mover ? options_.threshold : options_.movable_threshold;
}

void ContourWindow::forget_old(std::size_t now) {
  const std::size_t reach = std::max(window_ + static_cast<std::size_t>(options_.tolerance), sparse_window_);
  while (views_.front().frame + reach < now) views_.pop_front();
  const auto forget_after = static_cast<std::size_t>(options_.forget_after);
  std::erase_if(tracks_, [&](const auto& entry) { return now - entry.second.last_seen > forget_after; });
  movers_.forget_unseen(now);
}

}  // namespace ipl_slam
