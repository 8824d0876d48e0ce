#pragma once

#include <limits>
#include <vector>

#include <opencv2/core.hpp>

namespace ipl_slam {

/// How an image lies in the input of a network: scaled by one factor to fit, centred, the rest grey. This is
/// the geometry of Ultralytics' LetterBox, rounding included.
///
/// Coordinates are continuous: a pixel covers [x, x+1), its centre is x + 0.5. cv::resize keeps to this, so a
/// point of the image lies at input = point * scale + offset.
struct Letterbox {
  /// Scaled by at most `max_scale`, further down if the image does not fit into the input otherwise.
  Letterbox(cv::Size image, cv::Size input, double max_scale = std::numeric_limits<double>::infinity());

  cv::Size image, input;  ///< pixels
  cv::Rect content;       ///< where the image lies in the input
  double scale_x = 1.0;   ///< input pixels per image pixel; x and y differ by the rounding of `content`
  double scale_y = 1.0;

  [[nodiscard]] cv::Point2d to_input(cv::Point2d point) const {
    return {point.x * scale_x + content.x, point.y * scale_y + content.y};
  }
  [[nodiscard]] cv::Point2d to_image(cv::Point2d point) const {
    return {(point.x - content.x) / scale_x, (point.y - content.y) / scale_y};
  }
};

/// The network's input for an image (CV_8UC3 BGR or CV_8UC1, of the letterbox's image size): planes R, G, B
/// of input.height x input.width values from 0 to 1, one after the other. `planes` keeps its memory from call
/// to call.
void fill_letterbox(const cv::Mat& image, const Letterbox& letterbox, std::vector<float>& planes);

}  // namespace ipl_slam
