#include "loop/loop_closer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/log.hpp"

namespace ipl_slam {
namespace {

double degrees(double radians) {
  return radians * 180.0 / std::numbers::pi;
}

// How far apart two poses of one view are: of the camera, m, and of its direction, degrees.
std::pair<double, double> pose_gap(const SE3& T_cw_a, const SE3& T_cw_b) {
  const SE3 T_ab = T_cw_a * T_cw_b.inverse();
  return {T_ab.translation().norm(), degrees(Eigen::AngleAxisd(T_ab.rotation()).angle())};
}

// Length of the camera's way from one keyframe to another of the same part, by the keyframes between them.
double path_length(const Map& map, KeyframeId from, KeyframeId to) {
  if (to < from) std::swap(from, to);
  const PartId part = map.keyframes()[from].part;
  Eigen::Vector3d before = map.keyframes()[from].T_cw.inverse().translation();
  double length = 0.0;
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    if (id <= from || to < id || keyframe.part != part) return;
    const Eigen::Vector3d position = keyframe.T_cw.inverse().translation();
    length += (position - before).norm();
    before = position;
  });
  return length;
}

}  // namespace

LoopCloser::LoopCloser(const Camera& camera, const ScalePyramid& pyramid, const DepthNoiseOptions& noise,
                       const LoopOptions& options, const PoseOptimizerOptions& pose, std::uint64_t seed)
    : options_(options),
      index_(options.index),
      verifier_(camera, pyramid, noise, options.verifier, pose, seed) {}

void LoopCloser::learn(const Map& map) {
  map.keyframes().for_each([&](KeyframeId id, const Keyframe&) {
    if (!known_.contains(id)) note(map, id);
  });
}

void LoopCloser::note(const Map& map, KeyframeId id) {
  index_.add(id, static_descriptors(view_of(map.keyframes()[id])));
  known_.insert(id);
}

// Keyframes that share enough landmarks with it, and those that share enough with these: where they are
// relative to it is known already.
std::set<KeyframeId> LoopCloser::connected(const Map& map, KeyframeId id) const {
  std::set<KeyframeId> near{id};
  for (const Covisible& neighbour : map.covisible(id)) {
    if (neighbour.shared >= options_.min_shared) near.insert(neighbour.keyframe);
  }
  std::vector<std::uint8_t> seen(map.points().ids_used(), 0);
  std::vector<int> shared(map.keyframes().ids_used(), 0);
  for (const KeyframeId keyframe : std::set(near)) {
    for (const PointId point : map.keyframes()[keyframe].points) {
      if (!point.valid() || std::exchange(seen[point.value], 1)) continue;
      for (const Observation& o : map.points()[point].observations) {
        if (++shared[o.keyframe.value] == options_.min_shared) near.insert(o.keyframe);
      }
    }
  }
  return near;
}

std::optional<PlaceMatch> LoopCloser::look_for_loop(const Map& map, KeyframeId id) {
  std::erase_if(known_, [&](KeyframeId known) {
    if (map.keyframes().contains(known)) return false;
    index_.remove(known);
    return true;
  });
  std::optional<PlaceMatch> match;
  if (keyframes_to_wait_ > 0) {
    --keyframes_to_wait_;
  } else {
    std::vector<PlaceMatch> found = matches(map, view_of(map.keyframes()[id]), connected(map, id));
    std::erase_if(found, [&](const PlaceMatch& candidate) { return !plausible(map, id, candidate); });
    match = unrivalled(map, std::move(found));
    if (match && !confirmed(map, id, *match)) match.reset();
    if (match) keyframes_to_wait_ = options_.pause;
  }
  note(map, id);
  return match;
}

std::optional<PlaceMatch> LoopCloser::find(const Map& map, const PlaceView& view) const {
  return unrivalled(map, matches(map, view, {}));
}

std::vector<PlaceMatch> LoopCloser::matches(const Map& map, const PlaceView& view,
                                            const std::set<KeyframeId>& excluded) const {
  const auto eligible = [&](KeyframeId id) { return map.keyframes().contains(id) && !excluded.contains(id); };
  std::vector<PlaceMatch> found;
  for (const PlaceCandidate& candidate : index_.query(static_descriptors(view), eligible)) {
    if (auto match = verifier_.verify(map, view, candidate.keyframe)) found.push_back(std::move(*match));
  }
  return found;
}

// The match with most inliers, unless a place elsewhere has nearly as many: then there is no telling which of
// the two it is. Another part of the map may well show the same place, without it being known as the same.
std::optional<PlaceMatch> LoopCloser::unrivalled(const Map& map, std::vector<PlaceMatch> found) const {
  if (found.empty()) return std::nullopt;
  const auto best =
      std::max_element(found.begin(), found.end(),
                       [](const PlaceMatch& a, const PlaceMatch& b) { return a.inliers < b.inliers; });
  for (const PlaceMatch& other : found) {
    if (map.keyframes()[other.keyframe].part != map.keyframes()[best->keyframe].part) continue;
    const auto [distance, angle] = pose_gap(other.T_cw, best->T_cw);
    const bool elsewhere = distance > options_.rival_distance || angle > options_.rival_angle;
    if (elsewhere && other.inliers >= options_.rival_share * best->inliers) {
      log().debug("a place looks like keyframe {} ({} points) and like keyframe {} ({}): not believed",
                  best->keyframe.value, best->inliers, other.keyframe.value, other.inliers);
      return std::nullopt;
    }
  }
  return std::move(*best);
}

// Whether the way between the two visits can have gathered the error that the match says there is.
bool LoopCloser::plausible(const Map& map, KeyframeId id, const PlaceMatch& match) const {
  const Keyframe& current = map.keyframes()[id];
  if (map.keyframes()[match.keyframe].part != current.part) return true;  // nothing is known of the way
  const double path = path_length(map, match.keyframe, id);
  const auto [distance, angle] = pose_gap(current.T_cw, match.T_cw);
  const bool plausible = distance <= options_.drift_margin + options_.drift * path &&
                         angle <= options_.drift_angle_margin + options_.drift_angle * path;
  log().debug("keyframe {} looks like keyframe {} ({} points), which says it is off by {:.2f} m: {}",
              id.value, match.keyframe.value, match.inliers, distance,
              plausible ? "can be" : "too much for the way between them");
  return plausible;
}

// Neighbours see other things than the keyframe itself. They must find the place, too, where they would be.
bool LoopCloser::confirmed(const Map& map, KeyframeId id, const PlaceMatch& match) const {
  const SE3 T_wc = map.keyframes()[id].T_cw.inverse();
  int asked = 0, confirming = 0;
  for (const Covisible& neighbour : map.covisible(id)) {
    if (asked == options_.witnesses || confirming == options_.confirmations) break;
    ++asked;
    const SE3 T_cw = map.keyframes()[neighbour.keyframe].T_cw * T_wc * match.T_cw;
    if (verifier_.confirms(map, view_of(map.keyframes()[neighbour.keyframe]), T_cw, match.keyframe))
      ++confirming;
  }
  log().debug("keyframe {} at the place of keyframe {}: {} of {} neighbours confirm it", id.value,
              match.keyframe.value, confirming, asked);
  return confirming >= options_.confirmations;
}

}  // namespace ipl_slam
