#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "common/ids.hpp"
#include "dynamics/region_belief.hpp"
#include "segmentation/bit_mask.hpp"

namespace ipl_slam {

/// What was decided on a prior region in one frame, and by what.
struct RegionVerdict {
  bool dynamic = false;  ///< its features are removed
  RegionEvidence evidence = {};
  double belief = 0.0;  ///< log odds that it moves (RegionBelief); 0 where the rule does not ask
};

/// A prior region of a frame.
struct Region {
  InstanceId id;
  BitMask mask;  ///< as segmented; grown where it is dynamic (paper, section 3.4)
  RegionVerdict verdict = {};
};

/// Whether the pixel nearest to a position is on; false outside the mask.
[[nodiscard]] bool covers(const BitMask& mask, const Eigen::Vector2d& pixel);
/// Share of the way from start to end that lies in a mask, 0 to 1; 0 for an empty mask.
[[nodiscard]] double share_inside(const BitMask& mask, const Eigen::Vector2d& start,
                                  const Eigen::Vector2d& end);

/// How much each of a keyframe's features of one kind counts, and the region it lies in. Empty vectors: all
/// count fully and lie in no region.
struct FeatureTrust {
  std::vector<double> weights;      ///< alpha in [0, 1]; 0 = removed
  std::vector<InstanceId> regions;  ///< invalid = none

  [[nodiscard]] double weight(std::size_t feature) const { return weights.empty() ? 1.0 : weights[feature]; }
  [[nodiscard]] InstanceId region(std::size_t feature) const {
    return regions.empty() ? InstanceId{} : regions[feature];
  }
};

/// One entry per feature: 1 where its weight is 0, so that it is removed. `weights` may be empty: none is.
[[nodiscard]] std::vector<std::uint8_t> removed_features(const std::vector<double>& weights,
                                                         std::size_t features);

/// How much the features of a frame may say. Empty vectors: every feature has weight 1 and lies in no region.
struct FeatureWeights {
  std::vector<double> points;             ///< alpha_p per keypoint, in [0, 1]; 0 = removed
  std::vector<InstanceId> point_regions;  ///< per keypoint: the region it lies in; invalid = none
  std::shared_ptr<const std::vector<Region>> regions;  ///< never null once decided; distorted pixels
  BitMask dynamic;                                     ///< union of the dynamic regions, of the image's size

  [[nodiscard]] double point(std::size_t keypoint) const { return points.empty() ? 1.0 : points[keypoint]; }
  /// Whether a distorted pixel lies in a dynamic region.
  [[nodiscard]] bool in_dynamic(const Eigen::Vector2d& pixel) const { return covers(dynamic, pixel); }
  /// Share of the way from start to end (distorted pixels) that lies in dynamic regions, 0 to 1.
  [[nodiscard]] double dynamic_share(const Eigen::Vector2d& start, const Eigen::Vector2d& end) const {
    return share_inside(dynamic, start, end);
  }
};

}  // namespace ipl_slam
