#include "pipeline/map_keeper.hpp"

#include <algorithm>
#include <utility>

namespace ipl_slam {
namespace {

ScalePyramid pyramid_of(const Config& config) {
  return {config.orb.levels, config.orb.scale_factor};
}

}  // namespace

const char* to_string(PlaceEvent::Kind kind) {
  switch (kind) {
    case PlaceEvent::Kind::kLoop:
      return "loop";
    case PlaceEvent::Kind::kMerge:
      return "merge";
    case PlaceEvent::Kind::kRelocalized:
      return "relocalized";
  }
  return "?";
}

MapKeeper::MapKeeper(const Camera& camera, const Config& config, std::optional<Map> loaded)
    : camera_(camera),
      noise_(config.depth),
      mapping_(config.mapping),
      map_(loaded ? std::move(*loaded) : Map(pyramid_of(config))),
      mapper_(camera, pyramid_of(config), config.depth, config.mapping),
      correction_(camera, pyramid_of(config), config.depth, config.mapping, config.loops.correction),
      global_bundle_(config.loops.global_bundle) {
  if (!config.loops.enabled) return;
  loops_.emplace(camera, pyramid_of(config), config.depth, config.loops, config.tracking.pose,
                 config.schedule.seed);
  loops_->learn(map_);
}

std::shared_ptr<const LocalMap> MapKeeper::add(const KeyframeCandidate& candidate,
                                               const std::atomic<bool>* abort) {
  const KeyframeId id = mapper_.process(map_, candidate, abort);
  if (loops_) recognise(id);
  return around(id);
}

void MapKeeper::recognise(KeyframeId id) {
  const std::optional<PlaceMatch> match = loops_->look_for_loop(map_, id);
  if (!match) return;
  const PartId own = map_.keyframes()[id].part, other = map_.keyframes()[match->keyframe].part;
  PlaceEvent event{.frame_index = map_.keyframes()[id].frame->index,
                   .known_index = map_.keyframes()[match->keyframe].frame->index,
                   .inliers = match->inliers};
  if (own == other) {
    const CorrectionEffect effect = correction_.close_loop(map_, id, *match);
    if (!effect.done) return;
    event.translation = effect.translation;
    event.rotation = effect.rotation;
    unsettled_.insert(own);
  } else {
    event.kind = PlaceEvent::Kind::kMerge;
    correction_.merge_parts(map_, id, *match);
    follow_merge(std::min(own, other), std::max(own, other));
  }
  events_.push_back(event);
  ++corrections_;
}

// What was unsettled in the part that is gone is so in the one that took it up.
void MapKeeper::follow_merge(PartId kept, PartId gone) {
  if (unsettled_.erase(gone) > 0) unsettled_.insert(kept);
  if (settling_ == gone) settling_ = kept;
}

std::optional<FoundPlace> MapKeeper::find_place(const TrackedFrame& lost) const {
  if (!loops_) return std::nullopt;
  const std::optional<PlaceMatch> match =
      loops_->find(map_, {*lost.frame, {lost.weights.points, lost.weights.point_regions}});
  if (!match) return std::nullopt;
  LocalMap local = build_local_map(map_, match->keyframe, mapping_.local_map);
  local.corrections = corrections_;
  local.found = match->T_cw;
  return FoundPlace{std::make_shared<const LocalMap>(std::move(local)),
                    {.kind = PlaceEvent::Kind::kRelocalized,
                     .frame_index = lost.frame->index,
                     .known_index = map_.keyframes()[match->keyframe].frame->index,
                     .inliers = match->inliers}};
}

std::shared_ptr<const LocalMap> MapKeeper::around(KeyframeId id) const {
  LocalMap local = build_local_map(map_, map_.surviving(id), mapping_.local_map);
  local.corrections = corrections_;
  return std::make_shared<const LocalMap>(std::move(local));
}

std::shared_ptr<const LocalMap> MapKeeper::around_newest() const {
  return map_.newest_keyframe().valid() ? around(map_.newest_keyframe()) : nullptr;
}

GlobalBundle MapKeeper::begin_global_bundle() {
  corrections_at_bundle_ = corrections_;
  settling_ = *unsettled_.begin();
  unsettled_.erase(settling_);
  return {map_, settling_, camera_, noise_, mapping_.bundle.line_noise(), global_bundle_};
}

void MapKeeper::apply(const GlobalBundle& bundle) {
  const PartId part = std::exchange(settling_, PartId{});
  if (corrections_ == corrections_at_bundle_ && bundle.apply(map_)) {
    ++corrections_;
  } else {
    unsettled_.insert(part);
  }
}

}  // namespace ipl_slam
