#include "mapping/local_mapper.hpp"

namespace ipl_slam {

LocalMapper::LocalMapper(const Camera& camera, const ScalePyramid& pyramid, const DepthNoiseOptions& noise,
                         const MappingOptions& options)
    : camera_(camera),
      noise_(noise),
      options_(options),
      map_(pyramid),
      fusion_(camera, pyramid, noise, options.fusion),
      line_mapping_(camera, noise, options.lines),
      point_culling_(options.culling),
      line_culling_(options.culling) {}

std::shared_ptr<const LocalMap> LocalMapper::process(const KeyframeCandidate& candidate,
                                                     const std::atomic<bool>* abort) {
  const auto count = [&](const auto& sightings) {
    for (const auto& s : sightings) {
      const auto landmark = map_.resolve(s.landmark);
      if (landmark.valid()) map_.count_sightings(landmark, s.visible, s.found);
    }
  };
  count(candidate.sightings);
  count(candidate.line_sightings);
  remove_movers(candidate.tracked.weights);
  const KeyframeId id = insert(candidate);
  point_culling_.cull(map_);
  line_culling_.cull(map_);
  line_mapping_.associate(map_, id, candidate.tracked.lines);
  create_points(id);
  create_lines(id);
  if (map_.keyframes().size() > 1) {
    fusion_.fuse_around(map_, id);
    line_mapping_.fuse(map_, id);
    adjust_local_bundle(map_, id, camera_, noise_, options_.bundle, abort);
    cull_keyframes(map_, id, options_.culling);
  }
  return std::make_shared<const LocalMap>(build_local_map(map_, id, options_.local_map));
}

void LocalMapper::remove_movers(const FeatureWeights& weights) {
  removed_.clear();
  if (!weights.regions) return;
  for (const Region& region : *weights.regions) {
    if (!region.verdict.dynamic) continue;
    const RemovedLandmarks gone = remove_landmarks_on(map_, region.id);
    if (gone.points + gone.lines > 0) removed_.push_back({region.id, gone});
  }
}

KeyframeId LocalMapper::insert(const KeyframeCandidate& candidate) {
  const TrackedFrame& tracked = candidate.tracked;
  // The map may have moved since the frame was tracked; its place next to the reference keyframe is still
  // true.
  const SE3 T_cw =
      tracked.reference.valid() ? tracked.T_c_reference * map_.pose_of(tracked.reference) : tracked.T_cw;
  const KeyframeId id =
      map_.add_keyframe(tracked.frame, T_cw, candidate.lines,
                        {tracked.weights.points, tracked.weights.point_regions}, candidate.line_trust);
  for (std::uint32_t k = 0; k < tracked.points.size(); ++k) {
    const PointId point = map_.resolve(tracked.points[k]);
    if (!point.valid()) continue;
    map_.add_observation(point, id, k);
    map_.refresh(point);
  }
  return id;
}

void LocalMapper::create_points(KeyframeId id) {
  const std::shared_ptr<const Frame> frame = map_.keyframes()[id].frame;
  const SE3 T_wc = map_.keyframes()[id].T_cw.inverse();
  for (std::uint32_t k = 0; k < frame->features.size(); ++k) {
    const Keypoint& keypoint = frame->features.keypoints[k];
    if (map_.keyframes()[id].points[k].valid()) continue;
    if (keypoint.depth <= 0.0F || map_.keyframes()[id].point_trust.weight(k) <= 0.0) continue;
    const Eigen::Vector3d p_c = camera_.unproject(keypoint.undistorted.cast<double>(), keypoint.depth);
    point_culling_.watch(map_.add_point(T_wc * p_c, id, k));
  }
}

void LocalMapper::create_lines(KeyframeId id) {
  for (const LineId line : line_mapping_.create(map_, id)) line_culling_.watch(line);
}

}  // namespace ipl_slam
