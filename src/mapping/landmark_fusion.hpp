#pragma once

#include <span>

#include "common/options.hpp"
#include "features/matcher.hpp"
#include "geometry/depth_noise.hpp"
#include "map/map.hpp"
#include "tracking/visibility.hpp"

namespace ipl_slam {

struct LandmarkFusionOptions {
  int neighbours = 10;
  int second_neighbours = 3;
  double radius = 3.0;
  MatchOptions match;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("neighbours", neighbours,
             {0, 100, "count", "covisible keyframes a new keyframe shares its landmarks with"});
    v.number("second_neighbours", second_neighbours,
             {0, 100, "count", "best neighbours of each of these that join in"});
    v.number("radius", radius, {0.5, 20.0, "px", "search window around a landmark, at pyramid level 0"});
    v.section("match", match, "descriptor match of landmark and keypoint");
  }
};

/// Finds landmarks that are the same thing under two ids, and keypoints that see a landmark without knowing.
class LandmarkFusion {
 public:
  LandmarkFusion(const Camera& camera, const ScalePyramid& pyramid, const DepthNoiseOptions& noise,
                 const LandmarkFusionOptions& options)
      : camera_(camera), noise_(noise), options_(options), visibility_(camera, pyramid) {}

  /// Exchanges landmarks between a keyframe and its neighbours, both ways.
  void fuse_around(Map& map, KeyframeId id) const;
  /// Projects landmarks into a keyframe. Where one falls on a fitting keypoint that sees another landmark,
  /// the two become one; where the keypoint is free it observes the landmark from now on.
  void fuse_into(Map& map, KeyframeId target, std::span<const PointId> candidates) const;

 private:
  [[nodiscard]] bool agrees(const Map& map, const SE3& T_cw, PointId point, const Keypoint& keypoint) const;

  Camera camera_;
  DepthNoiseOptions noise_;
  LandmarkFusionOptions options_;
  Visibility visibility_;
};

}  // namespace ipl_slam
