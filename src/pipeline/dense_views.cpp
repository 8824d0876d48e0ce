#include "pipeline/dense_views.hpp"

#include <algorithm>
#include <utility>

namespace ipl_slam {

ViewAnchor anchor_of(const Map& map, KeyframeId id) {
  const KeyframeId reference = map.surviving(id);
  if (reference == id) return {reference, SE3()};
  return {reference, map.pose_of(id) * map.keyframes()[reference].T_cw.inverse()};
}

SE3 pose_of(const Map& map, const ViewAnchor& anchor) {
  return anchor.T_c_reference * map.keyframes()[anchor.reference].T_cw;
}

std::map<KeyframeId, ViewSituation> situations_of(const KeptKeyframes& kept, const Map& map, PartId part) {
  std::map<double, KeyframeId> by_time;
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    if (keyframe.part == part) by_time.emplace(keyframe.frame->timestamp, id);
  });
  std::map<KeyframeId, ViewSituation> situations;
  for (const auto& [id, keyframe] : kept) {
    const auto reference = by_time.find(keyframe.reference_time);
    if (reference == by_time.end()) continue;
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
    kept.emplace(id, KeptKeyframe{map.keyframes()[anchor.reference].frame->timestamp, anchor.T_c_reference,
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
