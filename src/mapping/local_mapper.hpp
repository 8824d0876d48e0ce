#pragma once

#include <atomic>
#include <memory>
#include <utility>
#include <vector>

#include "common/options.hpp"
#include "map/local_map.hpp"
#include "mapping/culling.hpp"
#include "mapping/landmark_fusion.hpp"
#include "mapping/line_mapping.hpp"
#include "mapping/local_bundle.hpp"
#include "mapping/mover_removal.hpp"
#include "tracking/tracked_frame.hpp"

namespace ipl_slam {

struct MappingOptions {
  LandmarkFusionOptions fusion;
  LineMappingOptions lines;
  CullingOptions culling;
  LocalBundleOptions bundle;
  LocalMapOptions local_map;

  template <class Visitor>
  void visit(Visitor& v) {
    v.section("fusion", fusion, "joining of points that are the same");
    v.section("lines", lines, "line landmarks");
    v.section("culling", culling, "removal of bad landmarks and redundant keyframes");
    v.section("bundle", bundle, "local bundle adjustment");
    v.section("local_map", local_map, "the part of the map the tracker works with");
  }
};

/// Builds the map: takes keyframes in, makes and joins landmarks, optimises around the newest keyframe.
class LocalMapper {
 public:
  LocalMapper(const Camera& camera, const ScalePyramid& pyramid, const DepthNoiseOptions& noise,
              const MappingOptions& options);

  /// Adds a keyframe to the map, always the same one, and works off what it brings. A candidate without a
  /// reference starts a new part of the map at its own pose. Bundle adjustment ends early when `abort`, if
  /// not null, is raised.
  KeyframeId process(Map& map, const KeyframeCandidate& candidate, const std::atomic<bool>* abort = nullptr);

  /// What the last keyframe took out of the map because it sat on something that turned out to move.
  [[nodiscard]] const std::vector<std::pair<InstanceId, RemovedLandmarks>>& removed() const {
    return removed_;
  }

 private:
  void remove_movers(Map& map, const FeatureWeights& weights);
  KeyframeId insert(Map& map, const KeyframeCandidate& candidate) const;
  void create_points(Map& map, KeyframeId id);
  void create_lines(Map& map, KeyframeId id);

  Camera camera_;
  DepthNoiseOptions noise_;
  MappingOptions options_;
  LandmarkFusion fusion_;
  LineMapping line_mapping_;
  LandmarkCulling<PointId> point_culling_;
  LandmarkCulling<LineId> line_culling_;
  std::vector<std::pair<InstanceId, RemovedLandmarks>> removed_;
};

}  // namespace ipl_slam
