#include "mapping/keyframe_policy.hpp"

namespace ipl_slam {
namespace {

// Landmarks of the reference keyframe that other keyframes have confirmed; young maps ask for less.
int confirmed_landmarks(const LocalMap& map, KeyframeId reference) {
  const int needed = map.keyframes.size() <= 2 ? 1 : 3;
  const LocalKeyframe* keyframe = map.find_keyframe(reference);
  if (!keyframe) return 0;
  int count = 0;
  for (const std::uint32_t point : keyframe->points)
    count += map.points[point].observations >= needed ? 1 : 0;
  for (const std::uint32_t line : keyframe->lines) count += map.lines[line].observations >= needed ? 1 : 0;
  return count;
}

}  // namespace

bool KeyframePolicy::wants(const TrackedFrame& tracked, const LocalMap& map, bool mapper_idle) {
  if (tracked.state != TrackingState::kTracking) return false;
  const double since_last = tracked.frame->timestamp - last_keyframe_;
  if (since_last < options_.min_interval) return false;

  int close_tracked = 0, close_untracked = 0;
  for (std::size_t k = 0; k < tracked.points.size(); ++k) {
    const float depth = tracked.frame->features.keypoints[k].depth;
    if (depth <= 0.0F || depth > options_.close_depth || tracked.weights.point(k) <= 0.0) continue;
    ++(tracked.points[k].valid() ? close_tracked : close_untracked);
  }
  const bool needs_close =
      close_tracked < options_.min_close_tracked && close_untracked > options_.max_close_untracked;
  const int confirmed = confirmed_landmarks(map, tracked.reference);
  const auto seen = static_cast<double>(tracked.inliers) + static_cast<double>(tracked.lines.size());
  const bool leaves_reference = seen < options_.min_shared * confirmed;
  // A quarter of the reference left: the next frame may already be lost.
  const bool urgent = seen < 0.25 * confirmed || needs_close;
  const bool overdue = since_last >= options_.max_interval;

  const bool wanted = mapper_idle ? overdue || leaves_reference || needs_close : urgent;
  if (wanted) last_keyframe_ = tracked.frame->timestamp;
  return wanted;
}

}  // namespace ipl_slam
