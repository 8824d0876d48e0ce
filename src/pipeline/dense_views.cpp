#include "pipeline/dense_views.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "common/fingerprint.hpp"

namespace ipl_slam {

ViewAnchor anchor_of(const Map& map, KeyframeId id) {
  const KeyframeId reference = map.surviving(id);
  if (reference == id) return {reference, SE3()};
  return {reference, map.pose_of(id) * map.keyframes()[reference].T_cw.inverse()};
}

SE3 pose_of(const Map& map, const ViewAnchor& anchor) {
  return anchor.T_c_reference * map.keyframes()[anchor.reference].T_cw;
}

namespace {

// Recordings of one map may have been taken at the same times.
std::string fingerprint_of(const Frame& frame) {
  const std::vector<Descriptor>& descriptors = frame.features.descriptors;
  return fingerprint(
      {reinterpret_cast<const char*>(descriptors.data()), descriptors.size() * sizeof(Descriptor)});
}

}  // namespace

std::map<KeyframeId, ViewSituation> situations_of(const KeptKeyframes& kept, const Map& map, PartId part) {
  std::map<std::pair<double, std::string>, KeyframeId> known;
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    const Frame& frame = *keyframe.frame;
    if (keyframe.part == part) known.emplace(std::pair(frame.timestamp, fingerprint_of(frame)), id);
  });
  std::map<KeyframeId, ViewSituation> situations;
  for (const auto& [id, keyframe] : kept) {
    const auto reference = known.find({keyframe.reference_time, keyframe.reference_fingerprint});
    if (reference == known.end()) continue;
    situations.emplace(
        id, ViewSituation{pose_of(map, {reference->second, keyframe.T_c_reference}), keyframe.moved});
  }
  return situations;
}

void DenseViews::add(KeyframeId id, KeptView view) {
  ever_dynamic_.insert(view.dynamic.begin(), view.dynamic.end());
  views_.emplace(id, std::move(view));
}

std::set<InstanceId> DenseViews::moved_in(KeyframeId id, const DynamicSpans* spans) const {
  const KeptView& view = views_.at(id);
  std::set<InstanceId> moved = view.dynamic;
  for (const InstanceId instance : view.classed) {
    if (spans != nullptr && spans->contains(instance, view.frame_index)) moved.insert(instance);
  }
  for (const InstanceId instance : view.unclassed) {
    if (ever_dynamic_.contains(instance) || (spans != nullptr && spans->contains(instance))) {
      moved.insert(instance);
    }
  }
  return moved;
}

std::map<KeyframeId, ViewSituation> DenseViews::in_part(const Map& map, PartId part,
                                                        const DynamicSpans* spans) const {
  std::map<KeyframeId, ViewSituation> situations;
  for (const auto& [id, view] : views_) {
    // In realtime the mapper may not have come to it yet.
    if (id.value >= map.keyframes().ids_used() || map.part_of(id) != part) continue;
    situations.emplace(id, ViewSituation{pose_of(map, anchor_of(map, id)), moved_in(id, spans)});
  }
  return situations;
}

KeptKeyframes DenseViews::kept(const Map& map, const DynamicSpans* spans) const {
  KeptKeyframes kept;
  for (const auto& [id, view] : views_) {
    if (id.value >= map.keyframes().ids_used()) continue;
    const ViewAnchor anchor = anchor_of(map, id);
    const Frame& reference = *map.keyframes()[anchor.reference].frame;
    kept.emplace(id, KeptKeyframe{reference.timestamp, fingerprint_of(reference), anchor.T_c_reference,
                                  moved_in(id, spans)});
  }
  return kept;
}

PartId DenseViews::main_part(const Map& map) const {
  std::map<PartId, std::size_t> count;
  for (const auto& [id, view] : views_) {
    if (id.value < map.keyframes().ids_used()) ++count[map.part_of(id)];
  }
  const auto most = std::max_element(count.begin(), count.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
  return most == count.end() ? PartId{} : most->first;
}

}  // namespace ipl_slam
