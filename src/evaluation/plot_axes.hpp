#pragma once

#include <string>

#include <opencv2/core.hpp>

#include "evaluation/plot_canvas.hpp"

namespace ipl_slam {

/// How plots look: colours (blue, green, red) and heights of capital letters, pixels.
namespace plot_style {
inline const cv::Scalar kTruth(0, 0, 0), kEstimate(196, 104, 24), kError(60, 50, 225),
    kErrorFill(226, 224, 250), kGrid(232, 232, 232), kFrame(130, 130, 130), kText(40, 40, 40);
inline constexpr double kTextHeight = 11.0, kTitleHeight = 14.0;
inline constexpr double kPixelsPerTick = 90.0;
}  // namespace plot_style

/// An interval of values that grows by what it is shown.
struct PlotRange {
  double low = 0.0, high = 0.0;
  bool empty = true;

  void add(double value);
  [[nodiscard]] double extent() const { return high - low; }
  [[nodiscard]] double middle() const { return 0.5 * (low + high); }
  /// Around the same middle, with this extent.
  void stretch_to(double extent);
};

/// A framed plot with its two axes: maps values to pixels, the y axis upwards.
struct PlotAxes {
  cv::Rect2d box;
  PlotRange x, y;

  [[nodiscard]] cv::Point2d at(double vx, double vy) const {
    return {box.x + (vx - x.low) / x.extent() * box.width,
            box.y + box.height - (vy - y.low) / y.extent() * box.height};
  }
};

/// Axes with the same scale on both that show all of the ranges, in metres, with a margin.
[[nodiscard]] PlotAxes metric_axes(const cv::Rect2d& box, PlotRange x, PlotRange y);

/// Draws grid, frame, tick labels and the names of the axes.
void draw_axes(PlotCanvas& canvas, const PlotAxes& axes, const std::string& x_label,
               const std::string& y_label, double pixels_per_y_tick = plot_style::kPixelsPerTick);

}  // namespace ipl_slam
