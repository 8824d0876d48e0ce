#pragma once

#include <opencv2/core.hpp>

#include "common/options.hpp"
#include "geometry/camera.hpp"

namespace ipl_slam {

/// Error of a structured-light camera's depth at 1 m, which grows with the square of depth (Khoshelham and
/// Elberink, "Accuracy and resolution of Kinect depth data", Sensors 2012). 1/m.
inline constexpr double kStructuredLightSigma = 0.0014;

/// Which measured depth is taken for a surface.
struct RangeOptions {
  double max_depth = 4.0;       ///< m
  double edge = 0.03;           ///< depth steps above this share of the depth are edges
  double min_incidence = 0.15;  ///< least cosine between ray and surface normal
  double detail = 0.005;        ///< m

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("max_depth", max_depth, {0.1, 100.0, "m", "depth beyond this does not enter the cloud"});
    v.number("edge", edge,
             {0.001, 1.0, "",
              "pixels beside a depth step above this share of the depth are left out: between two surfaces "
              "the camera measures depths where there is nothing"});
    v.number("min_incidence", min_incidence,
             {0.0, 1.0, "", "surfaces seen flatter than this (cosine of ray and normal) are left out"});
    v.number("detail", detail,
             {0.0, 1.0, "m",
              "depth is smoothed along surfaces, the more the farther its error is above this; 0: entirely"});
  }
};

/// Depth as the volume takes it in. Images of the size of the undistorted view, CV_32FC1.
struct RangeImage {
  cv::Mat depth;      ///< of the surface, m; 0 = none to be taken in
  cv::Mat incidence;  ///< distance to the surface's plane per metre of depth in front of it; 0 where depth is
  /// How far the rays about the pixel surely go: the least depth measured around it, m; 0 = not known. Also
  /// where somebody stands who is left out: up to there it is free.
  cv::Mat reach;
};

/// depth: CV_16UC1, raw units, undistorted. left_out: CV_8UC1, not 0 where no surface is to be taken in; may
/// be empty. camera: its distortion does not count. depth_sigma: error of depth at 1 m, 1/m.
[[nodiscard]] RangeImage make_range_image(const cv::Mat& depth, const cv::Mat& left_out, const Camera& camera,
                                          const RangeOptions& options,
                                          double depth_sigma = kStructuredLightSigma);

}  // namespace ipl_slam
