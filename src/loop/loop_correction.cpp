#include "loop/loop_correction.hpp"

#include <algorithm>
#include <cassert>
#include <iterator>
#include <vector>

#include "loop/correction_spread.hpp"
#include "loop/part_keyframes.hpp"
#include "mapping/local_bundle.hpp"
#include "mapping/map_bundle.hpp"
#include "mapping/seen_landmarks.hpp"

namespace ipl_slam {
namespace {

// How the world that `current` is drawn in moves for the match to be right: into the world of the match.
SE3 world_move(const Map& map, KeyframeId current, const PlaceMatch& match) {
  return match.T_cw.inverse() * map.keyframes()[current].T_cw;
}

LoopEdge loop_edge(const Map& map, KeyframeId current, const PlaceMatch& match) {
  return {current, match.keyframe, match.T_cw * map.keyframes()[match.keyframe].T_cw.inverse()};
}

CorrectionEffect effect_of(const Map& map, KeyframeId current, const PlaceMatch& match,
                           const std::set<KeyframeId>& here, const std::set<KeyframeId>& there) {
  const SE3 error = match.T_cw * map.keyframes()[current].T_cw.inverse();
  return {.done = true,
          .translation = error.translation().norm(),
          .rotation = error.angle(),
          .here = here.size(),
          .there = there.size()};
}

}  // namespace

LoopCorrection::LoopCorrection(const Camera& camera, const ScalePyramid& pyramid,
                               const DepthNoiseOptions& noise, const MappingOptions& mapping,
                               const LoopCorrectionOptions& options)
    : camera_(camera),
      noise_(noise),
      fusion_(camera, pyramid, noise, mapping.fusion),
      line_mapping_(camera, noise, mapping.lines),
      bundle_(mapping.bundle),
      options_(options) {}

CorrectionEffect LoopCorrection::close_loop(Map& map, KeyframeId current, const PlaceMatch& match,
                                            const std::atomic<bool>* abort) const {
  const PartId part = map.keyframes()[current].part;
  assert(part == map.keyframes()[match.keyframe].part && current != match.keyframe);
  const Sides sides = sides_of(map, current, match.keyframe);
  const SE3 move = world_move(map, current, match);
  const KeyframeId anchor = map.anchor(part);
  const bool here_moves = !sides.here.contains(anchor);

  KeyframePoses held;
  held.emplace(anchor, map.keyframes()[anchor].T_cw);
  for (const KeyframeId id : here_moves ? sides.there : sides.here)
    held.emplace(id, map.keyframes()[id].T_cw);
  for (const KeyframeId id : here_moves ? sides.here : sides.there)
    held.emplace(id, map.keyframes()[id].T_cw * (here_moves ? move.inverse() : move));
  const auto poses =
      spread_correction(map, essential_graph(map, part, options_.graph), held, options_.solver, abort);
  if (!poses) return {};

  CorrectionEffect effect = effect_of(map, current, match, sides.here, sides.there);
  map.add_loop(loop_edge(map, current, match));
  move_keyframes(map, *poses, held);
  join(map, current, match, sides, effect);
  return effect;
}

CorrectionEffect LoopCorrection::merge_parts(Map& map, KeyframeId current, const PlaceMatch& match,
                                             const std::atomic<bool>* abort) const {
  const PartId mine = map.keyframes()[current].part, other = map.keyframes()[match.keyframe].part;
  assert(mine != other);
  const PartId kept = std::min(mine, other), gone = std::max(mine, other);
  const Sides sides = sides_of(map, current, match.keyframe);
  const SE3 move = world_move(map, current, match);
  const std::set<KeyframeId> kept_keyframes = part_keyframes(map, kept);
  const std::vector<EssentialEdge> gone_graph = essential_graph(map, gone, options_.graph);

  CorrectionEffect effect = effect_of(map, current, match, sides.here, sides.there);
  map.add_loop(loop_edge(map, current, match));
  map.merge_parts(kept, gone, kept == other ? move : move.inverse());
  join(map, current, match, sides, effect);
  weld(map, sides, kept_keyframes, gone_graph, abort);
  return effect;
}

// Around `current` and the keyframe that was found. What is near both lies between the sides.
LoopCorrection::Sides LoopCorrection::sides_of(const Map& map, KeyframeId current, KeyframeId found) const {
  Sides sides{keyframes_around(map, current, options_.side_keyframes, options_.min_shared),
              keyframes_around(map, found, options_.side_keyframes, options_.min_shared)};
  sides.here.erase(found);
  sides.there.erase(current);
  std::vector<KeyframeId> both;
  std::set_intersection(sides.here.begin(), sides.here.end(), sides.there.begin(), sides.there.end(),
                        std::back_inserter(both));
  for (const KeyframeId id : both) {
    sides.here.erase(id);
    sides.there.erase(id);
  }
  return sides;
}

// Joins what both sides see; they must stand right to each other by now.
void LoopCorrection::join(Map& map, KeyframeId current, const PlaceMatch& match, const Sides& sides,
                          CorrectionEffect& effect) const {
  const std::size_t points = map.points().size(), lines = map.lines().size();
  join_matched(map, current, match);
  for (const KeyframeId target : sides.here) {
    // Asked for anew each time: fusion changes what they see.
    fusion_.fuse_into(map, target, seen_landmarks(map, sides.there, &Keyframe::points));
    line_mapping_.fuse_into(map, target, seen_landmarks(map, sides.there, &Keyframe::lines));
  }
  effect.points = points - map.points().size();
  effect.lines = lines - map.lines().size();
}

// The landmarks that the match found in the current keyframe.
void LoopCorrection::join_matched(Map& map, KeyframeId current, const PlaceMatch& match) const {
  for (std::uint32_t k = 0; k < match.points.size(); ++k) {
    const PointId found = map.resolve(match.points[k]), own = map.keyframes()[current].points[k];
    if (!found.valid()) continue;
    if (own.valid()) {
      map.fuse(found, own);
    } else {
      map.add_observation(found, current, k);
      map.refresh(found);
    }
  }
  for (std::uint32_t s = 0; s < match.lines.size(); ++s) {
    const LineId found = map.resolve(match.lines[s]), own = map.keyframes()[current].lines[s];
    if (!found.valid()) continue;
    if (own.valid()) {
      line_mapping_.join(map, found, own);
    } else {
      map.add_observation(found, current, s);
      map.refresh(found);
    }
  }
}

// Adjusts both sides of the seam, which the older part alone holds in place, and has the rest of the younger
// part follow.
void LoopCorrection::weld(Map& map, const Sides& sides, const std::set<KeyframeId>& kept,
                          const std::vector<EssentialEdge>& gone_graph,
                          const std::atomic<bool>* abort) const {
  std::set<KeyframeId> seam = sides.here;
  seam.insert(sides.there.begin(), sides.there.end());
  const std::set<KeyframeId> fixed = holding_keyframes(map, seam, bundle_.max_fixed_keyframes, &kept);
  MapBundle bundle(map, seam, fixed, bundle_.line_noise());
  const BundleResult result = adjust_bundle(bundle.problem, camera_, noise_, bundle_.solver, abort);
  bundle.write_back(map, result, camera_, noise_);

  KeyframePoses held;
  for (const KeyframeId id : seam)
    if (!kept.contains(id)) held.emplace(id, map.keyframes()[id].T_cw);
  if (const auto poses = spread_correction(map, gone_graph, held, options_.solver, abort))
    move_keyframes(map, *poses, held);
}

}  // namespace ipl_slam
