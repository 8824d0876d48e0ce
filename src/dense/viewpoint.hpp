#pragma once

#include <cstddef>

#include <opencv2/core.hpp>

#include "dataset/trajectory.hpp"
#include "dense/semantic_cloud.hpp"
#include "dense/upright.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {

/// From where and how a picture of a cloud is taken.
struct Viewpoint {
  SE3 T_vw;                   ///< view (x right, y down, z forward) from the world
  cv::Size size{1280, 720};   ///< of the picture, pixels
  bool orthographic = false;  ///< all rays along z; else from the view's origin
  double scale = 600.0;       ///< pixels per metre; of a perspective view at a depth of 1 m (focal length)
};

/// From above, all of the cloud in the picture but for strays: x of the upright frame to the right, y up.
[[nodiscard]] Viewpoint top_view(const SemanticCloud& cloud, const Upright& upright, const cv::Size& size);

/// From outside towards the cloud's middle, from so far that it fills the picture. azimuth: of the viewer,
/// seen from the middle, anticlockwise from the upright frame's x; elevation: of the viewer over the horizon;
/// both in degrees.
[[nodiscard]] Viewpoint orbit_view(const SemanticCloud& cloud, const Upright& upright, double azimuth,
                                   double elevation, const cv::Size& size);

/// As the camera saw it, from some way behind and above its pose, so that the picture shows where it is.
[[nodiscard]] Viewpoint trajectory_view(const SE3& T_wc, const Upright& upright, const cv::Size& size);

}  // namespace ipl_slam
