#include "loop/global_bundle.hpp"

#include <algorithm>
#include <set>

#include "loop/correction_spread.hpp"
#include "loop/part_keyframes.hpp"

namespace ipl_slam {
namespace {

// A landmark seen once agrees with its keyframe wherever that stands: it says nothing of poses.
constexpr std::size_t kMinObservations = 2;

// The keyframe that one without a new pose keeps its place to.
KeyframeId leader(const Map& map, KeyframeId id, const KeyframePoses& placed) {
  for (const Covisible& neighbour : map.covisible(id))
    if (placed.contains(neighbour.keyframe)) return neighbour.keyframe;
  const auto after = placed.lower_bound(id);
  return after == placed.begin() ? after->first : std::prev(after)->first;
}

}  // namespace

GlobalBundle::GlobalBundle(const Map& map, PartId part, const Camera& camera, const DepthNoiseOptions& noise,
                           const LineNoise& line_noise, const BundleOptions& options)
    : part_(part),
      camera_(camera),
      noise_(noise),
      options_(options),
      loops_(map.loops().size()),
      bundle_(map, part_keyframes(map, part), {}, line_noise, kMinObservations) {}

bool GlobalBundle::solve(const std::atomic<bool>* abort) {
  result_ = adjust_bundle(bundle_.problem, camera_, noise_, options_, abort);
  solved_ = !result_.aborted;
  return solved_;
}

bool GlobalBundle::apply(Map& map) const {
  if (!solved_ || !map.anchor(part_).valid() || map.loops().size() > loops_) return false;
  KeyframePoses poses;
  for (std::size_t i = 0; i < bundle_.keyframes().size(); ++i)
    if (map.keyframes().contains(bundle_.keyframes()[i]))
      poses.emplace(bundle_.keyframes()[i], bundle_.problem.poses[i].T_cw);
  for (const KeyframeId id : part_keyframes(map, part_)) {
    if (poses.contains(id)) continue;
    const KeyframeId other = leader(map, id, poses);
    poses.emplace(id, map.keyframes()[id].T_cw * map.keyframes()[other].T_cw.inverse() * poses.at(other));
  }
  move_keyframes(map, poses);
  bundle_.write_back(map, result_, camera_, noise_);
  return true;
}

}  // namespace ipl_slam
