#pragma once

#include <opencv2/core.hpp>

#include "common/options.hpp"
#include "geometry/camera.hpp"
#include "geometry/depth_noise.hpp"

namespace ipl_slam {

/// How a keypoint's depth is read from the depth image.
struct KeypointDepthOptions {
  int radius = 1;            ///< half size of the neighbourhood, pixels; 0 reads the single pixel
  double edge_gap = 0.05;    ///< a jump of inverse depth inside the neighbourhood beyond this is an edge, 1/m
  bool reject_edges = true;  ///< keypoints on an edge get no depth; otherwise that of the nearest pixel

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("radius", radius,
             {0, 5, "pixel", "half size of the neighbourhood a keypoint's depth is read from"});
    v.number(
        "edge_gap", edge_gap,
        {1e-4, 10.0, "1/m", "jump of inverse depth in the neighbourhood from which on it is a depth edge"});
    v.flag("reject_edges", reject_edges, "keypoints on a depth edge get no depth");
  }
};

/// Depth in metres at pixel (u, v) of the raw depth image (CV_16UC1, registered to the colour image; u and v
/// as the keypoint lies in the image, distorted). The nearest valid pixel of the neighbourhood counts. 0
/// where there is none, where it lies beyond noise.max_depth, or on a depth edge if those are rejected: there
/// the keypoint's background and foreground cannot be told apart, and a wrong choice is an outlier of
/// decimetres.
[[nodiscard]] float keypoint_depth(const cv::Mat& depth, float u, float v, const Camera& camera,
                                   const DepthNoiseOptions& noise, const KeypointDepthOptions& options);

}  // namespace ipl_slam
