#pragma once

#include <vector>

#include <opencv2/core.hpp>

namespace ipl_slam {

/// The same point of an instance in two frames, pixels.
struct PointMove {
  cv::Point2f from, to;
};

/// Where each pixel of a new frame was in the old one, told from some points of the instance it belongs to:
/// a robust similarity (shift, turn, scale) for the instance as a whole, plus what the points near the pixel
/// depart from it.
class MotionField {
 public:
  /// moves: at least one. size: of the images. reach: distance in pixels up to which a point's own motion
  /// counts (deviation of a Gaussian).
  MotionField(const std::vector<PointMove>& moves, cv::Size size, double reach);

  /// Where the pixels (x, y) with first <= x < last of the new frame were.
  void sources(int first, int last, int y, cv::Point2f* sources) const;
  /// The rectangle of the new frame that holds all pixels that were in `box`.
  [[nodiscard]] cv::Rect moved(cv::Rect box) const;

 private:
  static constexpr int kCell = 16;  // pixels; departures are kept on a grid and interpolated

  [[nodiscard]] cv::Point2f similarity(cv::Point2f p) const {
    return {a_ * p.x - b_ * p.y + t_.x, b_ * p.x + a_ * p.y + t_.y};
  }
  void fit_similarity(const std::vector<PointMove>& moves);
  void fit_departures(const std::vector<PointMove>& moves, float reach);

  float a_ = 1.0F, b_ = 0.0F;  // scale times cosine and sine of the turn, new -> old
  cv::Point2f t_;
  cv::Size size_;
  cv::Size grid_;
  std::vector<cv::Point2f> departures_;  // per node of the grid, row by row
};

}  // namespace ipl_slam
