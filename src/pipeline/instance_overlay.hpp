#pragma once

#include <functional>
#include <vector>

#include <opencv2/core.hpp>

#include "dynamics/contour_window.hpp"
#include "dynamics/feature_weights.hpp"
#include "segmentation/instance.hpp"

namespace ipl_slam {

/// A colour (or grey) picture with its instances: masks tinted and outlined by state (amber = candidate,
/// green = still, red = moving), boxes, and "class score #id state" at each. `verdict` says what is known of
/// an instance; the word for its state is left out without it. The regions of `weights` whose features are
/// removed, which are grown, are outlined in red and white dashes. CV_8UC3, of the picture's size.
[[nodiscard]] cv::Mat draw_instances(const cv::Mat& image, const std::vector<TrackedInstance>& instances,
                                     const std::function<ContourVerdict(InstanceId)>& verdict = {},
                                     const FeatureWeights& weights = {});

}  // namespace ipl_slam
