#pragma once

#include <opencv2/core.hpp>

#include "geometry/camera.hpp"
#include "geometry/se3.hpp"
#include "segmentation/bit_mask.hpp"

namespace ipl_slam {

/// What a depth camera saw from a known pose, thinned out: truth on which views show the same place.
struct DepthView {
  SE3 T_wc;
  cv::Mat depth;  ///< CV_32FC1, metres, 0 = none; pixel (x, y) is the undistorted pixel (x, y) * kStep

  static constexpr int kStep = 4;
};

/// `depth`: CV_16UC1 in raw units, as it lies in the (distorted) image. What `moving` covers gets no depth;
/// an empty mask covers nothing.
[[nodiscard]] DepthView make_depth_view(const cv::Mat& depth, const SE3& T_wc, const Camera& camera,
                                        const BitMask& moving = {});

/// Share of what `a` has depth of that `b` sees as well: it projects into its image, and the depth there
/// agrees within kOverlapTolerance of it. 0 where `a` has no depth. Every 4th value of `a` in x and y is
/// tried.
[[nodiscard]] double seen_share(const DepthView& a, const DepthView& b, const Camera& camera);

/// Depths that differ by a smaller share belong to one surface: four times the error of a Kinect at 5 m,
/// 0.0012 z^2 (Khoshelham and Elberink, Sensors 2012), is 2.4 %; the rest is for slanted surfaces, whose
/// depth changes within kStep pixels, and for poses that are a few centimetres off.
inline constexpr double kOverlapTolerance = 0.06;

}  // namespace ipl_slam
