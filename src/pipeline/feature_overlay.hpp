#pragma once

#include <opencv2/core.hpp>

#include "dynamics/feature_weights.hpp"
#include "geometry/camera.hpp"
#include "tracking/tracked_frame.hpp"

namespace ipl_slam {

/// Draws the features of a frame into its picture (CV_8UC3), coloured by what they may say (paper, figure
/// 12), with a legend in the lower left corner:
///
///   keypoints that agree with the pose   filled dots, red (weight 0) through yellow to green (weight 1)
///   keypoints of weight 0                red crosses: removed, whether or not they agree
///   other keypoints                      small grey dots
///   lines that agree with the pose       red (weight 0) through purple to blue (weight 1), ends marked
///
/// Lines are straight where the lens distortion is removed; in the picture they bend as the image does.
void draw_features(cv::Mat& picture, const TrackedFrame& frame, const FeatureWeights& weights,
                   const Camera& camera);

}  // namespace ipl_slam
