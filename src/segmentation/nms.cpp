#include "segmentation/nms.hpp"

#include <algorithm>
#include <cstddef>

namespace ipl_slam {

float box_iou(const Detection& a, const Detection& b) {
  const float width = std::min(a.x1, b.x1) - std::max(a.x0, b.x0);
  const float height = std::min(a.y1, b.y1) - std::max(a.y0, b.y0);
  if (width <= 0.0F || height <= 0.0F) return 0.0F;
  const float both = width * height;
  return both / ((a.x1 - a.x0) * (a.y1 - a.y0) + (b.x1 - b.x0) * (b.y1 - b.y0) - both);
}

std::vector<Detection> suppress_overlaps(std::vector<Detection> detections, float max_iou, int max_count) {
  std::sort(detections.begin(), detections.end(), [](const Detection& a, const Detection& b) {
    return a.score != b.score ? a.score > b.score : a.anchor < b.anchor;
  });
  std::vector<Detection> kept;
  for (const Detection& candidate : detections) {
    if (kept.size() >= static_cast<std::size_t>(max_count)) break;
    const bool covered = std::any_of(kept.begin(), kept.end(), [&](const Detection& better) {
      return better.class_index == candidate.class_index && box_iou(better, candidate) > max_iou;
    });
    if (!covered) kept.push_back(candidate);
  }
  return kept;
}

}  // namespace ipl_slam
