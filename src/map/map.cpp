#include "map/map.hpp"

#include <algorithm>
#include <cassert>

namespace ipl_slam {
namespace {

// Index of the descriptor whose median distance to the others is least: the one that stands for the point
// best.
std::size_t most_typical(const std::vector<Descriptor>& descriptors) {
  const std::size_t n = descriptors.size();
  std::size_t best = 0;
  int best_median = 257;
  std::vector<int> distances(n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) distances[j] = hamming_distance(descriptors[i], descriptors[j]);
    const auto middle = distances.begin() + static_cast<std::ptrdiff_t>((n - 1) / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    if (*middle < best_median) {
      best_median = *middle;
      best = i;
    }
  }
  return best;
}

}  // namespace

KeyframeId Map::add_keyframe(std::shared_ptr<const Frame> frame, const SE3& T_cw) {
  std::vector<PointId> points(frame->features.size());
  newest_ = keyframes_.insert({T_cw, std::move(frame), std::move(points)});
  return newest_;
}

void Map::remove_keyframe(KeyframeId id) {
  assert(id != newest_);
  const std::vector<Covisible> neighbours = covisible(id);
  KeyframeId parent = neighbours.empty() ? newest_ : neighbours.front().keyframe;
  const RemovedKeyframe removed{id, parent, keyframes_[id].T_cw * keyframes_[parent].T_cw.inverse()};
  removed_.insert(std::lower_bound(removed_.begin(), removed_.end(), id,
                                   [](const RemovedKeyframe& r, KeyframeId i) { return r.id < i; }),
                  removed);
  const std::vector<PointId> points = keyframes_[id].points;
  for (const PointId point : points) {
    if (point.valid()) remove_observation(point, id);
  }
  keyframes_.erase(id);
}

PointId Map::add_point(const Eigen::Vector3d& position_w, KeyframeId keyframe, std::uint32_t keypoint) {
  assert(!keyframes_[keyframe].points[keypoint].valid());
  Point point;
  point.position = position_w;
  point.first_keyframe = newest_;
  const PointId id = points_.insert(std::move(point));
  became_.push_back(id);
  add_observation(id, keyframe, keypoint);
  refresh(id);
  return id;
}

void Map::remove_point(PointId id) {
  for (const PointObservation& o : points_[id].observations)
    keyframes_[o.keyframe].points[o.keypoint] = PointId{};
  points_.erase(id);
  became_[id.value] = PointId{};
}

void Map::count_sightings(PointId id, int visible, int found) {
  points_[id].visible += visible;
  points_[id].found += found;
}

void Map::add_observation(PointId id, KeyframeId keyframe, std::uint32_t keypoint) {
  PointId& slot = keyframes_[keyframe].points[keypoint];
  auto& observations = points_[id].observations;
  const auto at = std::lower_bound(observations.begin(), observations.end(), keyframe,
                                   [](const PointObservation& o, KeyframeId k) { return o.keyframe < k; });
  if (slot.valid() || (at != observations.end() && at->keyframe == keyframe)) return;
  slot = id;
  observations.insert(at, {keyframe, keypoint});
}

void Map::remove_observation(PointId id, KeyframeId keyframe) {
  auto& observations = points_[id].observations;
  const auto at = std::find_if(observations.begin(), observations.end(),
                               [&](const PointObservation& o) { return o.keyframe == keyframe; });
  if (at == observations.end()) return;
  keyframes_[keyframe].points[at->keypoint] = PointId{};
  observations.erase(at);
  if (observations.empty()) remove_point(id);
}

void Map::fuse(PointId kept, PointId gone) {
  if (kept == gone) return;
  const Point old = points_[gone];
  remove_point(gone);
  became_[gone.value] = kept;
  for (const PointObservation& o : old.observations) add_observation(kept, o.keyframe, o.keypoint);
  count_sightings(kept, old.visible, old.found);
  refresh(kept);
}

void Map::refresh(PointId id) {
  Point& point = points_[id];
  std::vector<Descriptor> descriptors;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  double max_distance = 0.0;
  for (const PointObservation& o : point.observations) {
    const Keyframe& keyframe = keyframes_[o.keyframe];
    const Eigen::Vector3d ray = point.position - keyframe.T_cw.inverse().translation();
    const double distance = ray.norm();
    direction += ray / std::max(distance, 1e-9);
    descriptors.push_back(keyframe.frame->features.descriptors[o.keypoint]);
    // Each sight tells at what distance the patch would lie on level 0.
    max_distance += distance * pyramid_.scale(keyframe.frame->features.keypoints[o.keypoint].level);
  }
  point.descriptor = descriptors[most_typical(descriptors)];
  point.normal = direction.normalized();
  point.max_distance = max_distance / static_cast<double>(point.observations.size());
  point.min_distance = point.max_distance / pyramid_.scale(pyramid_.levels() - 1);
}

PointId Map::resolve(PointId id) const {
  while (id.valid() && became_[id.value] != id) id = became_[id.value];
  return id;
}

SE3 Map::pose_of(KeyframeId id) const {
  SE3 T_c_ancestor;
  while (!keyframes_.contains(id)) {
    const auto at = std::lower_bound(removed_.begin(), removed_.end(), id,
                                     [](const RemovedKeyframe& r, KeyframeId i) { return r.id < i; });
    T_c_ancestor = T_c_ancestor * at->T_c_parent;
    id = at->parent;
  }
  return T_c_ancestor * keyframes_[id].T_cw;
}

std::vector<Covisible> Map::covisible(KeyframeId id) const {
  std::vector<int> shared(keyframes_.ids_used(), 0);
  for (const PointId point : keyframes_[id].points) {
    if (!point.valid()) continue;
    for (const PointObservation& o : points_[point].observations) ++shared[o.keyframe.value];
  }
  shared[id.value] = 0;
  std::vector<Covisible> result;
  for (std::uint32_t i = 0; i < shared.size(); ++i) {
    if (shared[i] > 0) result.push_back({KeyframeId{i}, shared[i]});
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const Covisible& a, const Covisible& b) { return a.shared > b.shared; });
  return result;
}

bool Map::observes(KeyframeId keyframe, PointId id) const {
  const auto& observations = points_[id].observations;
  return std::binary_search(
      observations.begin(), observations.end(), PointObservation{keyframe, 0},
      [](const PointObservation& a, const PointObservation& b) { return a.keyframe < b.keyframe; });
}

}  // namespace ipl_slam
