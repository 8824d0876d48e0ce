#include "dynamics/contour_window.hpp"

#include <algorithm>
#include <cstdlib>
#include <numeric>
#include <stdexcept>
#include <utility>

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
  options.threshold = 0.85;
  options.movable_threshold = 0.85;
  options.iou_weight = 0.5;
  options.robust = false;
  options.compensate = false;
  options.record_table = false;
  return options;
}

const char* to_string(MotionState state) {
  switch (state) {
    case MotionState::kCandidate:
      return "candidate";
    case MotionState::kStill:
      return "still";
    case MotionState::kMoving:
      return "moving";
  }
  return "candidate";
}

ContourWindow::ContourWindow(const Camera& camera, const ContourWindowOptions& options)
    : options_(options),
      depth_scale_(camera.depth_scale),
      carried_(camera, options.carried),
      window_(static_cast<std::size_t>(options.window)),
      movers_(window_, static_cast<std::size_t>(options.forget_after)) {}

ContourVerdicts ContourWindow::process(const ContourFrame& frame) {
  if (last_frame_ && frame.index <= *last_frame_) {
    throw std::invalid_argument("ContourWindow::process: frames must be given in order");
  }
  last_frame_ = frame.index;
  views_.push_back(
      {frame.index, InstanceView(evidence(frame.instances), frame.depth, frame.T_wc, depth_scale_)});
  forget_old(frame.index);

  ContourVerdicts result;
  for (const TrackedInstance& tracked : frame.instances) {
    const Track new_track{frame.index, frame.index, {}, {tracked.id, MotionState::kCandidate, {}}};
    Track& track = tracks_.try_emplace(tracked.id, new_track).first->second;
    if (frame.index - track.last_seen > window_) track = new_track;
    track.last_seen = frame.index;
    movers_.saw(tracked.id, frame.index);
    const bool known_mover = movers_.contains(tracked.id);
    const std::optional<std::size_t> instance = index_of(views_.back().seen, tracked.id);
    if (known_mover) track.verdict.state = MotionState::kMoving;
    if (instance && known_mover) check_known_mover(track, *instance);
    if (instance && !known_mover) judge(track, *instance);

    result.verdicts.push_back(track.verdict);
    if (track.verdict.state != MotionState::kMoving) continue;
    // A fresh verdict is about the whole window, that of a known mover about the new mask.
    const std::size_t window_start = frame.index - std::min(frame.index, window_);
    const bool fresh = instance && !known_mover;
    result.dynamic.push_back(
        {tracked.id, fresh ? std::max(window_start, track.first_seen) : frame.index, frame.index});
  }
  return result;
}

void ContourWindow::judge(Track& track, std::size_t instance) {
  const std::size_t now = views_.back().frame;
  const std::optional<Pair> pair = compare(instance, options_.pair_gap);
  const std::optional<Pair> ends = compare(instance, options_.window);
  if (pair) {
    // A young track has nothing but its first mask to compare with; that one must not have many votes.
    if (!track.pairs.empty() && track.pairs.back().earlier == pair->earlier) track.pairs.pop_back();
    track.pairs.push_back(*pair);
  }
  // What stays are the pairs that lie inside the window as a whole.
  const std::size_t span = window_ - std::min(window_, static_cast<std::size_t>(options_.pair_gap));
  while (!track.pairs.empty() && track.pairs.front().later + span < now) track.pairs.pop_front();

  std::vector<double> similarities;
  for (const Pair& p : track.pairs) similarities.push_back(p.similarity);
  if (ends) similarities.push_back(ends->similarity);
  // With too few the last verdict stands.
  if (similarities.size() < static_cast<std::size_t>(options_.minimum_pairs)) return;
  const double similarity = options_.robust ? robust_mean_of(similarities) : mean_of(similarities);
  const bool moving = similarity < threshold_of(instance);
  track.verdict.similarity = similarity;
  track.verdict.state = moving ? MotionState::kMoving : MotionState::kStill;
  if (moving && options_.record_table) {
    movers_.add(track.verdict.id, now);
    track.pairs.clear();
  }
}

void ContourWindow::check_known_mover(Track& track, std::size_t instance) {
  const std::size_t now = views_.back().frame;
  if (now - movers_.last_check(track.verdict.id) < static_cast<std::size_t>(options_.pair_gap)) return;
  const std::optional<Pair> pair = compare(instance, options_.pair_gap);
  if (!pair) return;
  track.verdict.similarity = pair->similarity;
  movers_.check(track.verdict.id, pair->earlier, now, pair->similarity >= threshold_of(instance));
  if (!movers_.contains(track.verdict.id)) track.verdict.state = MotionState::kStill;
}

std::optional<ContourWindow::Pair> ContourWindow::compare(std::size_t instance, int gap) const {
  const View& now = views_.back();
  const InstanceId id = now.seen.instances[instance].id;
  const View* best = nullptr;
  std::size_t best_instance = 0;
  int best_difference = options_.tolerance + 1;
  for (const View& view : views_) {
    const int difference = std::abs(static_cast<int>(now.frame - view.frame) - gap);
    if (difference >= best_difference || &view == &now) continue;
    const std::optional<std::size_t> earlier_instance = index_of(view.seen, id);
    if (!earlier_instance) continue;
    best = &view;
    best_instance = *earlier_instance;
    best_difference = difference;
  }
  if (best == nullptr) return std::nullopt;
  if (!options_.compensate) {
    const BitMask& before = best->seen.instances[best_instance].instance.mask;
    const BitMask& after = now.seen.instances[instance].instance.mask;
    return Pair{best->frame, now.frame, shape_similarity(before, after, options_.iou_weight)};
  }
  const auto shapes = carried_.compare(best->seen, best_instance, now.seen, instance);
  if (!shapes) return std::nullopt;
  return Pair{
      best->frame, now.frame,
      shape_similarity(shapes->iou, hu_similarity(shapes->earlier, shapes->later), options_.iou_weight)};
}

double ContourWindow::threshold_of(std::size_t instance) const {
  const std::string& name = views_.back().seen.instances[instance].instance.class_name;
  return class_role(name) == ClassRole::likely_mover ? options_.threshold : options_.movable_threshold;
}

void ContourWindow::forget_old(std::size_t now) {
  const std::size_t reach = window_ + static_cast<std::size_t>(options_.tolerance);
  while (views_.front().frame + reach < now) views_.pop_front();
  const auto forget_after = static_cast<std::size_t>(options_.forget_after);
  std::erase_if(tracks_, [&](const auto& entry) { return now - entry.second.last_seen > forget_after; });
  movers_.forget_unseen(now);
}

}  // namespace ipl_slam
