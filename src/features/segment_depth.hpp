#pragma once

#include <opencv2/core.hpp>

#include "common/options.hpp"
#include "features/line_features.hpp"
#include "geometry/camera.hpp"
#include "geometry/depth_noise.hpp"

namespace ipl_slam {

/// Settings of the depth fit along a segment.
struct SegmentDepthOptions {
  double min_support = 0.5;  ///< share of the samples that must agree

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("min_support", min_support,
             {0.0, 1.0, "ratio", "share of the samples along a segment that must agree with its line"});
  }
};

/// Depth along a segment: a robust affine fit of the measured inverse depth. Not known where too few samples
/// agree. `depth` is CV_16UC1, raw units, registered to the colour image, or empty.
[[nodiscard]] SegmentDepth segment_depth(const cv::Mat& depth, const LineSegment& segment,
                                         const Camera& camera, const DepthNoiseOptions& noise,
                                         const SegmentDepthOptions& options);

}  // namespace ipl_slam
