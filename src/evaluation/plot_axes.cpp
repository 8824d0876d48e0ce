#include "evaluation/plot_axes.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace ipl_slam {

using namespace plot_style;
using Anchor = PlotCanvas::Anchor;

void PlotRange::add(double value) {
  low = empty ? value : std::min(low, value);
  high = empty ? value : std::max(high, value);
  empty = false;
}

void PlotRange::stretch_to(double extent) {
  const double center = middle();
  low = center - 0.5 * extent;
  high = center + 0.5 * extent;
}

PlotAxes metric_axes(const cv::Rect2d& box, PlotRange x, PlotRange y) {
  constexpr double margin = 1.12,
                   least_extent = 0.02;  // metres: a camera that stands still is no division by zero
  const double metres_per_pixel =
      margin * std::max({x.extent() / box.width, y.extent() / box.height, least_extent / box.height});
  x.stretch_to(metres_per_pixel * box.width);
  y.stretch_to(metres_per_pixel * box.height);
  return {box, x, y};
}

void draw_axes(PlotCanvas& canvas, const PlotAxes& axes, const std::string& x_label,
               const std::string& y_label, double pixels_per_y_tick) {
  const cv::Rect2d& box = axes.box;
  const double bottom = box.y + box.height, right = box.x + box.width;
  const Ticks x_ticks = ticks_between(axes.x.low, axes.x.high, box.width / kPixelsPerTick);
  for (const double value : x_ticks.values) {
    const double px = axes.at(value, axes.y.low).x;
    canvas.line({px, box.y}, {px, bottom}, kGrid, 1.0);
    canvas.text(fmt::format("{:.{}f}", value, x_ticks.decimals), {px, bottom + 15}, kTextHeight, kText,
                Anchor::kCenter);
  }
  const Ticks y_ticks = ticks_between(axes.y.low, axes.y.high, box.height / pixels_per_y_tick);
  for (const double value : y_ticks.values) {
    const double py = axes.at(axes.x.low, value).y;
    canvas.line({box.x, py}, {right, py}, kGrid, 1.0);
    canvas.text(fmt::format("{:.{}f}", value, y_ticks.decimals), {box.x - 8, py}, kTextHeight, kText,
                Anchor::kRight);
  }
  canvas.rectangle(box, kFrame, 1.0);
  canvas.text(x_label, {box.x + 0.5 * box.width, bottom + 38}, kTextHeight, kText, Anchor::kCenter);
  canvas.upward_text(y_label, {box.x - 72, box.y + 0.5 * box.height}, kTextHeight, kText);
}

}  // namespace ipl_slam
