#pragma once

#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "common/ids.hpp"

namespace ipl_slam {

/// Somebody or something in a view, with the identity it has in other views.
struct ViewInstance {
  InstanceId id;
  std::string class_name;
  float score = 0.0F;  ///< of the segmenter, 0 to 1

  friend bool operator==(const ViewInstance&, const ViewInstance&) = default;
};

/// What the cloud keeps of a keyframe. The images are of one size and undistorted: they fit the pinhole
/// camera `pinhole(camera)`.
struct DenseView {
  double timestamp = 0.0;               ///< s
  cv::Mat color;                        ///< CV_8UC3 (BGR)
  cv::Mat depth;                        ///< CV_16UC1, raw units (Camera::depth_scale per metre), 0 = no depth
  cv::Mat labels;                       ///< CV_8UC1: 0 = nobody, k = instances[k - 1]
  std::vector<ViewInstance> instances;  ///< 255 at most
};

}  // namespace ipl_slam
