#pragma once

#include <vector>

#include "dynamics/feature_weights.hpp"
#include "features/frame.hpp"
#include "features/line_features.hpp"
#include "map/map.hpp"

namespace ipl_slam {

/// What is to be placed in the map: a frame, or a keyframe with its lines. Frame and lines must outlive it.
struct PlaceView {
  const Frame& frame;
  FeatureTrust trust = {};              ///< of its keypoints; those of weight 0 are not used
  const LineFeatures* lines = nullptr;  ///< null = not looked for
  FeatureTrust line_trust = {};
};

/// A keyframe as a view.
[[nodiscard]] inline PlaceView view_of(const Keyframe& keyframe) {
  return {*keyframe.frame, keyframe.point_trust, keyframe.line_features.get(), keyframe.line_trust};
}

/// Descriptors of the keypoints that count: a place is known by what stays.
[[nodiscard]] inline std::vector<Descriptor> static_descriptors(const PlaceView& view) {
  std::vector<Descriptor> descriptors;
  const Features& features = view.frame.features;
  for (std::size_t k = 0; k < features.size(); ++k) {
    if (view.trust.weight(k) > 0.0) descriptors.push_back(features.descriptors[k]);
  }
  return descriptors;
}

}  // namespace ipl_slam
