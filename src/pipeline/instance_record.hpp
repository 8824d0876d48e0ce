#pragma once

#include <optional>
#include <string>

#include <opencv2/core.hpp>

#include "common/ids.hpp"
#include "dynamics/contour_window.hpp"

namespace ipl_slam {

/// What is remembered of an instance in a frame: everything but its mask.
struct InstanceRecord {
  InstanceId id;
  std::string class_name;
  float score = 0.0F;
  cv::Rect box;            ///< pixels
  int area = 0;            ///< of the mask, pixels
  int frames_carried = 0;  ///< source frames since a segmenter last saw it
  /// As known when the frame had been worked off; nothing where instances are not judged.
  std::optional<ContourVerdict> verdict;
};

}  // namespace ipl_slam
