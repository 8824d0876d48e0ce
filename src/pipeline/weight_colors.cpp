#include "pipeline/weight_colors.hpp"

#include <algorithm>

namespace ipl_slam {
namespace {

// Along two straight ways that meet at weight 1/2.
cv::Scalar blend(const cv::Scalar& low, const cv::Scalar& middle, const cv::Scalar& high, double weight) {
  const double way = 2.0 * std::clamp(weight, 0.0, 1.0);
  return way < 1.0 ? low + (middle - low) * way : middle + (high - middle) * (way - 1.0);
}

const cv::Scalar kRed(40, 40, 245);

}  // namespace

cv::Scalar point_color(double weight) {
  return blend(kRed, {30, 225, 245}, {90, 220, 60}, weight);
}

cv::Scalar line_color(double weight) {
  return blend(kRed, {190, 50, 190}, {255, 140, 20}, weight);
}

}  // namespace ipl_slam
