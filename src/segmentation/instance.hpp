#pragma once

#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "common/ids.hpp"
#include "segmentation/bit_mask.hpp"

namespace ipl_slam {

/// Something a segmenter saw in one image: a prior region, only a candidate for what moves (paper,
/// section 3.2).
struct Instance {
  std::string class_name;  ///< as the segmenter calls it, e.g. "person"; "unknown" where it knows no classes
  float score = 0.0F;      ///< confidence, 0 to 1
  cv::Rect box;            ///< pixels, inside the image, holds the mask
  BitMask mask;            ///< of the image's size; instances of one image may overlap
};

/// An instance with the identity it keeps from frame to frame.
struct TrackedInstance {
  InstanceId id;
  Instance instance;
  int frames_carried = 0;  ///< source frames since a segmenter last saw it; 0 = seen in this frame
};

}  // namespace ipl_slam
