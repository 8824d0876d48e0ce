#pragma once

#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "dense/semantic_cloud.hpp"

namespace ipl_slam {

/// Draws a box with names and colours into the upper left corner of a picture (CV_8UC3); what does not fit is
/// counted in its last line. Nothing for no classes.
void draw_legend(cv::Mat& picture, const std::vector<CloudClass>& classes);

}  // namespace ipl_slam
