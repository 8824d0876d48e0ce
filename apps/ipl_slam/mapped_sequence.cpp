#include "mapped_sequence.hpp"

#include <algorithm>
#include <cmath>

#include "dataset/association.hpp"
#include "segmentation/class_role.hpp"

namespace ipl_slam::cli {
namespace {

Config without_places(Config config) {
  config.loops.enabled = false;
  config.schedule.mode = "lockstep";
  config.dense.enabled = false;
  return config;
}

}  // namespace

std::optional<SE3> TruePoses::at(double timestamp) const {
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

bool may_walk_off(const Instance& instance) {
  return instance.class_name == "unknown" || class_role(instance.class_name) == ClassRole::likely_mover;
}

MappedSequence::MappedSequence(const Camera& camera, const Config& config, std::unique_ptr<RgbdSource> source,
                               const TruePoses& truth)
    : camera_(camera),
      pipeline_(camera, without_places(config)),
      closer_(camera, ScalePyramid(config.orb.levels, config.orb.scale_factor), config.depth, config.loops,
              config.tracking.pose, config.schedule.seed),
      source_(std::move(source)),
      next_(source_.next()),
      truth_(truth) {}

void MappedSequence::advance(double timestamp) {
  for (; next_ && next_->timestamp < timestamp; next_ = source_.next()) {
    if (next_->frame) process(*next_->frame);
  }
  read([&](const Map& map) { closer_.learn(map); });
}

void MappedSequence::process(const RgbdFrame& frame) {
  if (!pipeline_.process(frame).keyframe) return;
  const std::optional<SE3> T_wc = truth_.at(frame.timestamp);
  if (!T_wc) return;
  BitMask moving(frame.color.size());
  for (const TrackedInstance& tracked : pipeline_.last_instances()) {
    if (may_walk_off(tracked.instance)) moving |= tracked.instance.mask;
  }
  seen_.emplace(frame.index, make_depth_view(frame.depth, *T_wc, camera_, moving));
}

void MappedSequence::read(const std::function<void(const Map&)>& fn) const {
  pipeline_.mapping().read([&](const Map& map, const std::vector<MappingRecord>&) { fn(map); });
}

const DepthView* MappedSequence::seen_by(const Keyframe& keyframe) const {
  const auto found = seen_.find(keyframe.frame->index);
  return found == seen_.end() ? nullptr : &found->second;
}

std::optional<PlaceMatch> MappedSequence::find(const PlaceView& view) {
  std::optional<PlaceMatch> match;
  read([&](const Map& map) { match = closer_.find(map, view); });
  return match;
}

}  // namespace ipl_slam::cli
