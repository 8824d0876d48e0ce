#include "mapping/local_mapper.hpp"

namespace ipl_slam {

LocalMapper::LocalMapper(const Camera& camera, const ScalePyramid& pyramid, const DepthNoiseOptions& noise,
                         const MappingOptions& options)
    : camera_(camera),
      noise_(noise),
      options_(options),
      fusion_(camera, pyramid, noise, options.fusion),
      line_mapping_(camera, noise, options.lines),
      point_culling_(options.culling),
      line_culling_(options.culling) {}

KeyframeId LocalMapper::process(Map& map, const KeyframeCandidate& candidate,
                                const std::atomic<bool>* abort) {
  const auto count = [&](const auto& sightings) {
    for (const auto& s : sightings) {
      const auto landmark = map.resolve(s.landmark);
      if (landmark.valid()) map.count_sightings(landmark, s.visible, s.found);
    }
  };
  count(candidate.sightings);
  count(candidate.line_sightings);
  remove_movers(map, candidate.tracked.weights);
  const KeyframeId id = insert(map, candidate);
  point_culling_.cull(map);
  line_culling_.cull(map);
  line_mapping_.associate(map, id, candidate.tracked.lines);
  create_points(map, id);
  create_lines(map, id);
  if (!map.is_anchor(id)) {
    fusion_.fuse_around(map, id);
    line_mapping_.fuse(map, id);
    adjust_local_bundle(map, id, camera_, noise_, options_.bundle, abort);
    cull_keyframes(map, id, options_.culling);
  }
  return id;
}

void LocalMapper::remove_movers(Map& map, const FeatureWeights& weights) {
  removed_.clear();
  if (!weights.regions) return;
  for (const Region& region : *weights.regions) {
    if (!region.verdict.dynamic) continue;
    const RemovedLandmarks gone = remove_landmarks_on(map, region.id);
    if (gone.points + gone.lines > 0) removed_.push_back({region.id, gone});
  }
}

KeyframeId LocalMapper::insert(Map& map, const KeyframeCandidate& candidate) const {
  const TrackedFrame& tracked = candidate.tracked;
  // The map may have moved since the frame was tracked; its place next to the reference keyframe is still
  // true.
  const bool connected = tracked.reference.valid();
  const SE3 T_cw = connected ? tracked.T_c_reference * map.pose_of(tracked.reference) : tracked.T_cw;
  const KeyframeId id = map.add_keyframe(
      tracked.frame, T_cw, candidate.lines, {tracked.weights.points, tracked.weights.point_regions},
      candidate.line_trust, connected ? map.part_of(tracked.reference) : map.new_part());
  for (std::uint32_t k = 0; k < tracked.points.size(); ++k) {
    const PointId point = map.resolve(tracked.points[k]);
    if (!point.valid()) continue;
    map.add_observation(point, id, k);
    map.refresh(point);
  }
  return id;
}

void LocalMapper::create_points(Map& map, KeyframeId id) {
  const std::shared_ptr<const Frame> frame = map.keyframes()[id].frame;
  const SE3 T_wc = map.keyframes()[id].T_cw.inverse();
  for (std::uint32_t k = 0; k < frame->features.size(); ++k) {
    const Keypoint& keypoint = frame->features.keypoints[k];
    if (map.keyframes()[id].points[k].valid()) continue;
    if (keypoint.depth <= 0.0F || map.keyframes()[id].point_trust.weight(k) <= 0.0) continue;
    const Eigen::Vector3d p_c = camera_.unproject(keypoint.undistorted.cast<double>(), keypoint.depth);
    point_culling_.watch(map.add_point(T_wc * p_c, id, k));
  }
}

void LocalMapper::create_lines(Map& map, KeyframeId id) {
  for (const LineId line : line_mapping_.create(map, id)) line_culling_.watch(line);
}

}  // namespace ipl_slam
