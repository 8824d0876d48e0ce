#include "map/map.hpp"

#include <algorithm>
#include <cassert>
#include <set>

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

KeyframeId Map::add_keyframe(std::shared_ptr<const Frame> frame, const SE3& T_cw,
                             std::shared_ptr<const LineFeatures> line_features, FeatureTrust point_trust,
                             FeatureTrust line_trust, PartId part) {
  assert(part == new_part() || anchor(part).valid());
  if (!line_features) line_features = std::make_shared<const LineFeatures>();
  std::vector<PointId> points(frame->features.size());
  std::vector<LineId> lines(line_features->size());
  newest_ = keyframes_.insert({T_cw, std::move(frame), std::move(line_features), std::move(points),
                               std::move(lines), std::move(point_trust), std::move(line_trust), part});
  if (part == new_part()) anchors_.push_back(newest_);
  return newest_;
}

void Map::remove_keyframe(KeyframeId id) {
  assert(id != newest_ && !is_anchor(id));
  const std::vector<Covisible> neighbours = covisible(id);
  const KeyframeId parent = neighbours.empty() ? anchor(keyframes_[id].part) : neighbours.front().keyframe;
  const RemovedKeyframe removed{id, parent, keyframes_[id].T_cw * keyframes_[parent].T_cw.inverse()};
  removed_.insert(std::lower_bound(removed_.begin(), removed_.end(), id,
                                   [](const RemovedKeyframe& r, KeyframeId i) { return r.id < i; }),
                  removed);
  for (LoopEdge& edge : loops_) {
    if (edge.a == id) edge = {parent, edge.b, removed.T_c_parent.inverse() * edge.T_ab};
    if (edge.b == id) edge = {edge.a, parent, edge.T_ab * removed.T_c_parent};
  }
  std::erase_if(loops_, [](const LoopEdge& edge) { return edge.a == edge.b; });
  const auto forget = [&](const auto& landmarks) {
    for (const auto landmark : landmarks) {
      if (landmark.valid()) remove_observation(landmark, id);
    }
  };
  forget(std::vector(keyframes_[id].points));
  forget(std::vector(keyframes_[id].lines));
  keyframes_.erase(id);
}

template <class LandmarkId, class Landmark>
LandmarkId Map::insert(Landmark landmark, KeyframeId keyframe, std::uint32_t feature) {
  assert(!slot(keyframe, feature, LandmarkId{}).valid());
  landmark.first_keyframe = newest_;
  const LandmarkId id = store(LandmarkId{}).insert(std::move(landmark));
  became(id).push_back(id);
  add_observation(id, keyframe, feature);
  refresh(id);
  return id;
}

PointId Map::add_point(const Eigen::Vector3d& position_w, KeyframeId keyframe, std::uint32_t keypoint) {
  Point point;
  point.position = position_w;
  return insert<PointId>(std::move(point), keyframe, keypoint);
}

LineId Map::add_line(const Line3& line_w, const Eigen::Vector3d& start_w, const Eigen::Vector3d& end_w,
                     KeyframeId keyframe, std::uint32_t segment) {
  Line line;
  line.line = line_w;
  line.start = start_w;
  line.end = end_w;
  return insert<LineId>(std::move(line), keyframe, segment);
}

template <class LandmarkId, class Landmark>
LandmarkId Map::restore_as(Landmark landmark) {
  const LandmarkId id = store(LandmarkId{}).insert(std::move(landmark));
  became(id).push_back(id);
  for (const Observation& o : store(id)[id].observations) {
    assert(!slot(o.keyframe, o.feature, id).valid() && trust(o.keyframe, id).weight(o.feature) > 0.0);
    slot(o.keyframe, o.feature, id) = id;
  }
  refresh(id);
  return id;
}

PointId Map::restore(Point point) {
  return restore_as<PointId>(std::move(point));
}

LineId Map::restore(Line line) {
  return restore_as<LineId>(std::move(line));
}

void Map::set_line(LineId id, const Line3& line_w, const Eigen::Vector3d& start_w,
                   const Eigen::Vector3d& end_w) {
  Line& line = lines_[id];
  line.line = line_w;
  line.start = start_w;
  line.end = end_w;
}

template <class LandmarkId>
void Map::remove(LandmarkId id) {
  for (const Observation& o : store(id)[id].observations) slot(o.keyframe, o.feature, id) = LandmarkId{};
  store(id).erase(id);
  became(id)[id.value] = LandmarkId{};
}

template <class LandmarkId>
void Map::count_sightings(LandmarkId id, int visible, int found) {
  store(id)[id].visible += visible;
  store(id)[id].found += found;
}

template <class LandmarkId>
void Map::add_observation(LandmarkId id, KeyframeId keyframe, std::uint32_t feature) {
  LandmarkId& owner = slot(keyframe, feature, id);
  auto& observations = store(id)[id].observations;
  const auto at = std::lower_bound(observations.begin(), observations.end(), keyframe,
                                   [](const Observation& o, KeyframeId k) { return o.keyframe < k; });
  if (owner.valid() || (at != observations.end() && at->keyframe == keyframe)) return;
  if (trust(keyframe, id).weight(feature) <= 0.0) return;
  owner = id;
  observations.insert(at, {keyframe, feature});
}

template <class LandmarkId>
void Map::remove_observation(LandmarkId id, KeyframeId keyframe) {
  auto& observations = store(id)[id].observations;
  const auto at = std::find_if(observations.begin(), observations.end(),
                               [&](const Observation& o) { return o.keyframe == keyframe; });
  if (at == observations.end()) return;
  slot(keyframe, at->feature, id) = LandmarkId{};
  observations.erase(at);
  if (observations.empty()) remove(id);
}

template <class LandmarkId>
void Map::fuse(LandmarkId kept, LandmarkId gone) {
  if (kept == gone) return;
  const auto old = store(gone)[gone];
  remove(gone);
  became(gone)[gone.value] = kept;
  for (const Observation& o : old.observations) add_observation(kept, o.keyframe, o.feature);
  count_sightings(kept, old.visible, old.found);
  refresh(kept);
}

void Map::refresh(PointId id) {
  Point& point = points_[id];
  std::vector<Descriptor> descriptors;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  double max_distance = 0.0;
  for (const Observation& o : point.observations) {
    const Keyframe& keyframe = keyframes_[o.keyframe];
    const Eigen::Vector3d ray = point.position - keyframe.T_cw.inverse().translation();
    const double distance = ray.norm();
    direction += ray / std::max(distance, 1e-9);
    descriptors.push_back(keyframe.frame->features.descriptors[o.feature]);
    // Each sight tells at what distance the patch would lie on level 0.
    max_distance += distance * pyramid_.scale(keyframe.frame->features.keypoints[o.feature].level);
  }
  point.descriptor = descriptors[most_typical(descriptors)];
  point.normal = direction.normalized();
  point.max_distance = max_distance / static_cast<double>(point.observations.size());
  point.min_distance = point.max_distance / pyramid_.scale(pyramid_.levels() - 1);
}

void Map::refresh(LineId id) {
  Line& line = lines_[id];
  std::vector<Descriptor> descriptors;
  float contrast = 0.0F;
  for (const Observation& o : line.observations) {
    const LineFeatures& features = *keyframes_[o.keyframe].line_features;
    descriptors.push_back(features.descriptors[o.feature]);
    contrast += features.segments[o.feature].contrast;
  }
  line.descriptor = descriptors[most_typical(descriptors)];
  line.contrast = contrast / static_cast<float>(line.observations.size());
}

template <class LandmarkId>
LandmarkId Map::resolve(LandmarkId id) const {
  while (id.valid() && became(id)[id.value] != id) id = became(id)[id.value];
  return id;
}

const Map::RemovedKeyframe* Map::find_removed(KeyframeId id) const {
  const auto at = std::lower_bound(removed_.begin(), removed_.end(), id,
                                   [](const RemovedKeyframe& r, KeyframeId i) { return r.id < i; });
  return at != removed_.end() && at->id == id ? &*at : nullptr;
}

SE3 Map::pose_of(KeyframeId id) const {
  SE3 T_c_ancestor;
  while (const RemovedKeyframe* removed = find_removed(id)) {
    T_c_ancestor = T_c_ancestor * removed->T_c_parent;
    id = removed->parent;
  }
  return T_c_ancestor * keyframes_[id].T_cw;
}

KeyframeId Map::surviving(KeyframeId id) const {
  while (const RemovedKeyframe* removed = find_removed(id)) id = removed->parent;
  return id;
}

std::vector<PartId> Map::parts() const {
  std::vector<PartId> parts;
  for (std::uint32_t i = 0; i < anchors_.size(); ++i) {
    if (anchors_[i].valid()) parts.push_back(PartId{i});
  }
  return parts;
}

void Map::merge_parts(PartId kept, PartId gone, const SE3& T_kept_gone) {
  assert(kept < gone && anchor(kept).valid() && anchor(gone).valid());
  const SE3 T_gone_kept = T_kept_gone.inverse();
  std::vector<KeyframeId> moved;
  keyframes_.for_each([&](KeyframeId id, const Keyframe& keyframe) {
    if (keyframe.part == gone) moved.push_back(id);
  });
  std::set<PointId> points;
  std::set<LineId> lines;
  for (const KeyframeId id : moved) {
    Keyframe& keyframe = keyframes_[id];
    keyframe.part = kept;
    keyframe.T_cw = keyframe.T_cw * T_gone_kept;
    for (const PointId point : keyframe.points) {
      if (point.valid()) points.insert(point);
    }
    for (const LineId line : keyframe.lines) {
      if (line.valid()) lines.insert(line);
    }
  }
  for (const PointId id : points) {
    points_[id].position = T_kept_gone * points_[id].position;
    refresh(id);
  }
  for (const LineId id : lines) {
    const Line& line = lines_[id];
    set_line(id, T_kept_gone * line.line, T_kept_gone * line.start, T_kept_gone * line.end);
  }
  anchors_[gone.value] = KeyframeId{};
}

std::vector<Covisible> Map::covisible(KeyframeId id) const {
  std::vector<int> shared(keyframes_.ids_used(), 0);
  const auto count = [&](const auto& landmarks) {
    for (const auto landmark : landmarks) {
      if (!landmark.valid()) continue;
      for (const Observation& o : store(landmark)[landmark].observations) ++shared[o.keyframe.value];
    }
  };
  count(keyframes_[id].points);
  count(keyframes_[id].lines);
  shared[id.value] = 0;
  std::vector<Covisible> result;
  for (std::uint32_t i = 0; i < shared.size(); ++i) {
    if (shared[i] > 0) result.push_back({KeyframeId{i}, shared[i]});
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const Covisible& a, const Covisible& b) { return a.shared > b.shared; });
  return result;
}

template <class LandmarkId>
bool Map::observes(KeyframeId keyframe, LandmarkId id) const {
  const auto& observations = store(id)[id].observations;
  return std::binary_search(
      observations.begin(), observations.end(), Observation{keyframe, 0},
      [](const Observation& a, const Observation& b) { return a.keyframe < b.keyframe; });
}

template void Map::remove(PointId);
template void Map::remove(LineId);
template void Map::count_sightings(PointId, int, int);
template void Map::count_sightings(LineId, int, int);
template void Map::add_observation(PointId, KeyframeId, std::uint32_t);
template void Map::add_observation(LineId, KeyframeId, std::uint32_t);
template void Map::remove_observation(PointId, KeyframeId);
template void Map::remove_observation(LineId, KeyframeId);
template void Map::fuse(PointId, PointId);
template void Map::fuse(LineId, LineId);
template PointId Map::resolve(PointId) const;
template LineId Map::resolve(LineId) const;
template bool Map::observes(KeyframeId, PointId) const;
template bool Map::observes(KeyframeId, LineId) const;

}  // namespace ipl_slam
