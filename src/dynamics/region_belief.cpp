#include "dynamics/region_belief.hpp"

#include <algorithm>
#include <cmath>

#include "segmentation/class_role.hpp"

namespace ipl_slam {

double RegionBelief::prior(std::string_view class_name) const {
  if (class_name == "unknown") return options_.unknown;
  switch (class_role(class_name)) {
    case ClassRole::likely_mover:
      return options_.likely_mover;
    case ClassRole::background:
      return options_.background;
    case ClassRole::movable:
      break;
  }
  return options_.movable;
}

// Ratio of the binomial likelihoods of a mover and of something still. Nothing can be told in a frame in
// which what is still seems to move as much as a mover.
double RegionBelief::log_likelihood(int all, int moved, double moved_elsewhere) const {
  const double on_mover = options_.moved_on_mover;
  const double on_still = std::max(options_.moved_on_still, moved_elsewhere);
  if (on_still >= on_mover) return 0.0;
  return moved * std::log(on_mover / on_still) +
         (all - moved) * std::log((1.0 - on_mover) / (1.0 - on_still));
}

double RegionBelief::update(InstanceId id, std::size_t frame, std::string_view class_name,
                            const RegionEvidence& evidence) {
  Record& record = records_[id];
  record.frame = frame;
  const double seen = log_likelihood(evidence.points, evidence.moved_points, evidence.moved_elsewhere) +
                      log_likelihood(evidence.lines, evidence.moved_lines, 0.0);
  record.counted = std::clamp(
      options_.memory * record.counted + std::clamp(seen, -options_.frame_still, options_.frame_moving),
      -options_.most_still, options_.most_moving);
  const double contour = evidence.contour == MotionState::kMoving  ? options_.contour
                         : evidence.contour == MotionState::kStill ? -options_.contour
                                                                   : 0.0;
  record.belief = prior(class_name) + contour + record.counted;
  return record.belief;
}

double RegionBelief::of(InstanceId id, std::string_view class_name) const {
  const auto record = records_.find(id);
  return record != records_.end() ? record->second.belief : prior(class_name);
}

void RegionBelief::forget_before(std::size_t frame) {
  std::erase_if(records_, [&](const auto& entry) { return entry.second.frame < frame; });
}

}  // namespace ipl_slam
