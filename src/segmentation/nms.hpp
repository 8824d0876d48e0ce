#pragma once

#include <vector>

namespace ipl_slam {

/// A box that a detector proposes; x0 < x1 and y0 < y1 in any unit.
struct Detection {
  float x0 = 0.0F, y0 = 0.0F, x1 = 0.0F, y1 = 0.0F;
  float score = 0.0F;
  int class_index = 0;
  int anchor = 0;  ///< the detector's own number for it
};

/// Common area of two boxes by the area of both together; 0 where they do not overlap.
[[nodiscard]] float box_iou(const Detection& a, const Detection& b);

/// Class-aware non-maximum suppression: of boxes of one class that overlap by an IoU above `max_iou` only the
/// best stays. What stays comes best score first, of equal scores the lower anchor, and at most `max_count`
/// boxes.
[[nodiscard]] std::vector<Detection> suppress_overlaps(std::vector<Detection> detections, float max_iou,
                                                       int max_count);

}  // namespace ipl_slam
