#pragma once

#include <opencv2/core.hpp>

#include "geometry/camera.hpp"
#include "tracking/tracked_frame.hpp"

namespace ipl_slam {

/// Draws the features of a frame into its picture (CV_8UC3): keypoints that agree with the pose as filled
/// green dots, others as small grey ones, lines that agree with it in blue. Lines are straight where the lens
/// distortion is removed; in the picture they bend as the image does.
void draw_features(cv::Mat& picture, const TrackedFrame& frame, const Camera& camera);

}  // namespace ipl_slam
