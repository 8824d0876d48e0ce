#pragma once

#include <cstddef>

#include "features/feature_grid.hpp"
#include "features/features.hpp"

namespace ipl_slam {

/// What is left of a camera frame once the feature stage has seen it. Never changes after it was made; the
/// tracker and the map share it.
struct Frame {
  std::size_t index = 0;   ///< position in the source
  double timestamp = 0.0;  ///< seconds
  Features features;
  FeatureGrid grid;  ///< over the undistorted keypoints
};

}  // namespace ipl_slam
