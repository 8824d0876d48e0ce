#pragma once

#include "common/options.hpp"

namespace ipl_slam {

/// How far measured depth can be trusted. A structured-light or stereo camera measures disparity, so its
/// error is constant in inverse depth and grows with the square of depth (Khoshelham and Elberink, "Accuracy
/// and resolution of Kinect depth data", Sensors 2012).
struct DepthNoiseOptions {
  double inverse_depth_sigma = 0.04;  ///< standard deviation of 1/z, 1/m
  double max_depth = 10.0;            ///< measured depth beyond this is not used, m

  template <class Visitor>
  void visit(Visitor& v) {
    v.number(
        "inverse_depth_sigma", inverse_depth_sigma,
        {1e-5, 1.0, "1/m", "standard deviation of measured inverse depth; depth error = this x depth^2"});
    v.number("max_depth", max_depth, {0.1, 1000.0, "m", "measured depth beyond this is treated as missing"});
  }
};

}  // namespace ipl_slam
