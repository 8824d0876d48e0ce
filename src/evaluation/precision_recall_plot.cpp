#include "evaluation/precision_recall_plot.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "common/atomic_file.hpp"
#include "evaluation/plot_axes.hpp"

namespace ipl_slam {
namespace {

using namespace plot_style;

constexpr double kHeadroom = 1.02;  // so that a curve along 1 is not hidden by the frame

std::array<cv::Scalar, 3> curve_colors() {
  return {kEstimate, kError, kTruth};
}

// Precision is held from the last point on the way to the next; the first point's back to recall 0.
std::vector<cv::Point2d> steps(const PlotAxes& axes, const std::vector<PrecisionRecallPoint>& points) {
  std::vector<cv::Point2d> line;
  if (!points.empty()) line.push_back(axes.at(0.0, points.front().precision));
  for (const PrecisionRecallPoint& p : points) line.push_back(axes.at(p.recall, p.precision));
  return line;
}

void draw_legend(PlotCanvas& canvas, const cv::Rect2d& plot, const std::vector<NamedCurve>& curves) {
  constexpr double row = 22.0, sample = 34.0, margin = 16.0;
  double y = plot.y + plot.height - margin - row * (static_cast<double>(curves.size()) - 0.5);
  for (std::size_t i = 0; i < curves.size(); ++i, y += row) {
    const double x = plot.x + margin;
    canvas.line({x, y}, {x + sample, y}, curve_colors()[i % curve_colors().size()], 2.2);
    canvas.text(fmt::format("{}, recall {:.3f} at precision 1", curves[i].name,
                            recall_at_full_precision(curves[i].points)),
                {x + 1.3 * sample, y}, kTextHeight, kText);
  }
}

}  // namespace

cv::Mat draw_precision_recall(const std::vector<NamedCurve>& curves, const std::string& title) {
  constexpr int width = 800, height = 700;
  constexpr double left = 90, right = 40, top = 52, bottom = 64;
  PlotCanvas canvas(width, height);
  const cv::Rect2d box(left, top, width - left - right, height - top - bottom);
  const PlotAxes axes{box, {0.0, kHeadroom, false}, {0.0, kHeadroom, false}};
  draw_axes(canvas, axes, "recall", "precision");
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const std::vector<cv::Point2d> line = steps(axes, curves[i].points);
    if (line.empty()) continue;
    canvas.polyline(line, curve_colors()[i % curve_colors().size()], 2.2);
    canvas.disc(line.back(), 3.5, curve_colors()[i % curve_colors().size()]);
  }
  draw_legend(canvas, box, curves);
  canvas.text(title, {left, 0.5 * top}, kTitleHeight, kText);
  return canvas.picture();
}

void write_precision_recall_plot(const std::filesystem::path& file, const std::vector<NamedCurve>& curves,
                                 const std::string& title) {
  write_image_atomically(file, draw_precision_recall(curves, title));
}

}  // namespace ipl_slam
