#pragma once

#include <optional>
#include <string>

#include <opencv2/core.hpp>

#include "common/ids.hpp"
#include "dynamics/contour_window.hpp"
#include "dynamics/feature_weights.hpp"
#include "mapping/mover_removal.hpp"
#include "segmentation/instance.hpp"

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
  std::optional<ContourVerdict> verdict = {};
  /// As the frame was tracked; nothing where instances are not judged.
  std::optional<RegionVerdict> region = {};
  /// Landmarks on it that left the map with this frame, a keyframe, because it turned out to move.
  RemovedLandmarks removed = {};
};

/// Without a verdict.
[[nodiscard]] inline InstanceRecord record_of(const TrackedInstance& tracked) {
  const Instance& i = tracked.instance;
  return {tracked.id, i.class_name, i.score, i.box, i.mask.area(), tracked.frames_carried};
}

}  // namespace ipl_slam
