#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "segmentation/bit_mask.hpp"
#include "segmentation/instance.hpp"

namespace ipl_slam {

/// A prior region of a frame and what was decided on it.
struct Region {
  InstanceId id;
  BitMask mask;          ///< as segmented; grown where `dynamic` (paper, section 3.4)
  bool dynamic = false;  ///< its features are removed
};

/// How much the features of a frame may say. Empty vectors: every feature has weight 1 and lies in no region.
struct FeatureWeights {
  std::vector<double> points;             ///< alpha_p per keypoint, in [0, 1]; 0 = removed
  std::vector<InstanceId> point_regions;  ///< per keypoint: the region it lies in; invalid = none
  std::shared_ptr<const std::vector<Region>> regions;  ///< never null once decided; distorted pixels
  BitMask dynamic;                                     ///< union of the dynamic regions, of the image's size

  [[nodiscard]] double point(std::size_t keypoint) const { return points.empty() ? 1.0 : points[keypoint]; }
  /// Share of the way from start to end (distorted pixels) that lies in dynamic regions, 0 to 1.
  [[nodiscard]] double dynamic_share(const Eigen::Vector2d& start, const Eigen::Vector2d& end) const;
};

}  // namespace ipl_slam
