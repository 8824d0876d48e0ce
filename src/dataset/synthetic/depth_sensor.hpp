#pragma once

#include <cstdint>

#include <opencv2/core.hpp>

#include "common/options.hpp"
#include "geometry/camera.hpp"

namespace ipl_slam::synthetic {

/// Errors of a structured-light depth camera of the first Kinect's kind. It finds, for every pixel, the
/// disparity d = focal_baseline / z of a projected pattern; noise and rounding are therefore constant in d
/// and grow as z^2 in depth (Khoshelham and Elberink, "Accuracy and resolution of Kinect depth data", Sensors
/// 2012).
struct DepthSensorOptions {
  double focal_baseline = 580.0 * 0.075;  ///< pixels x metres
  double disparity_step = 0.125;          ///< pixels; 0 = none
  double disparity_sigma =
      0.0625;               ///< pixels, before rounding; Khoshelham and Elberink measured 1.4 mm at 1 m
  double min_range = 0.4;   ///< metres
  double max_range = 8.0;   ///< metres
  double baseline = 0.075;  ///< metres between projector and camera: what only one sees has no depth
  bool holes = true;        ///< shadows, ragged edges, grazing angles

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("focal_baseline", focal_baseline, {1.0, 1000.0, "px m", "disparity = this / depth"});
    v.number("disparity_step", disparity_step,
             {0.0, 1.0, "px", "disparities are rounded to multiples of this"});
    v.number("disparity_sigma", disparity_sigma,
             {0.0, 1.0, "px", "standard deviation of disparity before rounding"});
    v.number("min_range", min_range, {0.0, 10.0, "m", "nearer surfaces have no depth"});
    v.number("max_range", max_range, {0.5, 13.0, "m", "farther surfaces have no depth"});
    v.number("baseline", baseline, {0.0, 1.0, "m", "distance of the projector, whose shadows have no depth"});
    v.flag("holes", holes, "no depth in the projector's shadow, at ragged edges and at grazing angles");
  }
};

/// Depth as the sensor would report it. depth: CV_32FC1, true metres, 0 = nothing there; incidence: CV_32FC1,
/// cosine of the viewing angle. Returns metres, 0 = no depth. Each pixel's noise depends on noise_seed and
/// its place alone.
[[nodiscard]] cv::Mat measure_depth(const cv::Mat& depth, const cv::Mat& incidence, const Camera& camera,
                                    const DepthSensorOptions& options, std::uint64_t noise_seed);

/// Metres to raw units, rounded; beyond 16 bits = 0.
[[nodiscard]] cv::Mat depth_to_raw(const cv::Mat& depth, double depth_scale);

/// Rounds a CV_32FC3 image to 8 bits after adding normal noise of variance read_sigma^2 + shot_gain x grey
/// value.
[[nodiscard]] cv::Mat expose_color(const cv::Mat& color, double read_sigma, double shot_gain,
                                   std::uint64_t noise_seed);

}  // namespace ipl_slam::synthetic
