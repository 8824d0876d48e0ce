#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "segmentation/bit_mask.hpp"
#include "segmentation/letterbox.hpp"
#include "segmentation/nms.hpp"

namespace ipl_slam {

/// What a segmenting YOLOv8 or YOLO11 network gives for one image. Of each of its `anchors` places:
/// box centre, width and height in input pixels, a score per class, and mask coefficients; the value of
/// channel c at anchor a is channels[c * anchors + a]. A mask is a weighted sum of `prototypes`, planes of
/// prototype_size that cover the whole input.
struct YoloOutput {
  const float* channels = nullptr;  ///< 4 + classes + coefficients rows of `anchors` values
  const float* prototypes = nullptr;
  int anchors = 0;
  int classes = 0;
  int coefficients = 0;
  cv::Size prototype_size;

  [[nodiscard]] const float* channel(int index) const {
    return channels + static_cast<std::size_t>(index) * static_cast<std::size_t>(anchors);
  }
  [[nodiscard]] const float* prototype(int index) const {
    return prototypes + static_cast<std::size_t>(index) * static_cast<std::size_t>(prototype_size.area());
  }
};

/// The anchors whose best class scores at least `min_score` and is selected; boxes in input pixels.
/// `selected` holds one value per class.
[[nodiscard]] std::vector<Detection> find_candidates(const YoloOutput& output, float min_score,
                                                     const std::vector<bool>& selected);

/// The pixels of the image whose centres lie in a detection's box; empty for a box outside the image.
[[nodiscard]] cv::Rect image_box(const Detection& detection, const Letterbox& letterbox);

/// The mask of a detection at the image's size, cut to `box` (pixels, inside the image): on where the sum of
/// prototypes, interpolated bilinearly at the pixel's centre, is positive (its sigmoid above 0.5).
[[nodiscard]] BitMask decode_mask(const YoloOutput& output, const Detection& detection, const cv::Rect& box,
                                  const Letterbox& letterbox);

}  // namespace ipl_slam
