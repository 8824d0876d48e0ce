#include "evaluation/trajectory_plot.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include <fmt/format.h>

#include "common/atomic_file.hpp"
#include "evaluation/plot_axes.hpp"

namespace ipl_slam {
namespace {

using namespace plot_style;
using Anchor = PlotCanvas::Anchor;

/// Positions with their times, as both paths are drawn.
struct Path {
  std::vector<double> times;
  std::vector<Eigen::Vector3d> positions;
};

Path path_of(const Trajectory& trajectory, const SE3& T) {
  Path path;
  for (const StampedPose& pose : trajectory) {
    path.times.push_back(pose.timestamp);
    path.positions.push_back(T * pose.T_wc.translation());
  }
  return path;
}

/// A time step longer than this is a gap, over which no line is drawn.
double longest_step(const std::vector<double>& times) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
  return AteResult::kMaxGap * error_statistics(steps).median;
}

/// Splits a curve where its times have gaps.
std::vector<std::vector<cv::Point2d>> pieces(const std::vector<double>& times,
                                             const std::vector<cv::Point2d>& points) {
  const double longest = longest_step(times);
  std::vector<std::vector<cv::Point2d>> result;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i == 0 || times[i] - times[i - 1] > longest) result.emplace_back();
    result.back().push_back(points[i]);
  }
  return result;
}

/// The two axes the paths spread most along, in the order x, y, z.
std::array<int, 2> widest_axes(const std::array<PlotRange, 3>& ranges) {
  int narrowest = 2;  // of equals, z is left out: the view is from above
  for (const int axis : {1, 0}) {
    if (ranges[static_cast<std::size_t>(axis)].extent() <
        ranges[static_cast<std::size_t>(narrowest)].extent()) {
      narrowest = axis;
    }
  }
  return {narrowest == 0 ? 1 : 0, narrowest == 2 ? 1 : 2};
}

void draw_path(PlotCanvas& canvas, const PlotAxes& axes, const std::array<int, 2>& shown, const Path& path,
               const cv::Scalar& color, double thickness) {
  std::vector<cv::Point2d> points;
  for (const Eigen::Vector3d& p : path.positions) points.push_back(axes.at(p[shown[0]], p[shown[1]]));
  for (const auto& piece : pieces(path.times, points)) {
    if (piece.size() == 1) canvas.disc(piece.front(), thickness, color);
    canvas.polyline(piece, color, thickness);
  }
}

void draw_legend(PlotCanvas& canvas, const cv::Rect2d& plot) {
  struct Item {
    const char* name;
    const cv::Scalar& color;
    double thickness;
  };
  const std::array<Item, 3> items = {
      {{"ground truth", kTruth, 1.6}, {"estimated", kEstimate, 2.2}, {"difference", kError, 1.2}}};
  constexpr double row = 21.0, sample = 34.0, padding = 11.0;
  const double width = 2.5 * padding + sample + PlotCanvas::text_width("ground truth", kTextHeight);
  const cv::Rect2d box(plot.x + plot.width - width - 12, plot.y + 12, width, padding + row * items.size());
  canvas.fill(box, cv::Scalar::all(255));
  canvas.rectangle(box, kGrid, 1.0);
  for (std::size_t i = 0; i < items.size(); ++i) {
    const double y = box.y + 0.5 * padding + row * (static_cast<double>(i) + 0.5);
    canvas.line({box.x + padding, y}, {box.x + padding + sample, y}, items[i].color, items[i].thickness);
    canvas.text(items[i].name, {box.x + 1.5 * padding + sample, y}, kTextHeight, kText);
  }
}

void draw_paths(PlotCanvas& canvas, const cv::Rect2d& box, const Trajectory& ground_truth,
                const Trajectory& estimate, const AteResult& ate) {
  const Path truth = path_of(ground_truth, SE3()), estimated = path_of(estimate, ate.T_ge);
  std::array<PlotRange, 3> ranges;
  for (const Path* path : {&truth, &estimated}) {
    for (const Eigen::Vector3d& p : path->positions) {
      for (std::size_t axis = 0; axis < 3; ++axis) ranges[axis].add(p[static_cast<int>(axis)]);
    }
  }
  const std::array<int, 2> shown = widest_axes(ranges);
  const PlotAxes axes = metric_axes(box, ranges[static_cast<std::size_t>(shown[0])],
                                    ranges[static_cast<std::size_t>(shown[1])]);
  constexpr const char* names = "xyz";
  draw_axes(canvas, axes, fmt::format("{} [m]", names[shown[0]]), fmt::format("{} [m]", names[shown[1]]),
            kPixelsPerTick * 0.8);
  for (const AlignedPair& pair : ate.aligned) {
    canvas.line(axes.at(pair.truth[shown[0]], pair.truth[shown[1]]),
                axes.at(pair.estimate[shown[0]], pair.estimate[shown[1]]), kError, 1.2);
  }
  draw_path(canvas, axes, shown, truth, kTruth, 1.6);  // over the differences, which may hide it
  draw_path(canvas, axes, shown, estimated, kEstimate, 2.2);
  draw_legend(canvas, box);
}

void draw_errors(PlotCanvas& canvas, const cv::Rect2d& box, const AteResult& ate) {
  constexpr double headroom = 1.12, least_error = 1e-3, least_time = 1e-3;  // metres, seconds: no empty axis
  const double start = ate.aligned.front().timestamp;
  const double end = std::max(ate.aligned.back().timestamp - start, least_time);
  const PlotAxes axes{box, {0.0, end, false}, {0.0, headroom * std::max(ate.max, least_error), false}};
  draw_axes(canvas, axes, "time [s]", "error [m]", 38.0);

  std::vector<double> times;
  std::vector<cv::Point2d> points;
  for (const AlignedPair& pair : ate.aligned) {
    times.push_back(pair.timestamp);
    points.push_back(axes.at(pair.timestamp - start, pair.error()));
  }
  const double floor = box.y + box.height;
  for (std::vector<cv::Point2d>& piece : pieces(times, points)) {
    std::vector<cv::Point2d> area = piece;
    area.push_back({piece.back().x, floor});
    area.push_back({piece.front().x, floor});
    canvas.polygon(area, kErrorFill);
    canvas.polyline(piece, kError, 1.4);
  }
  canvas.dashed_line(axes.at(0.0, ate.rmse), axes.at(end, ate.rmse), kFrame, 1.2);
  canvas.text("rmse", axes.at(end, ate.rmse) + cv::Point2d(7, 0), kTextHeight, kFrame);
  canvas.rectangle(box, kFrame, 1.0);
}

/// The title, or as much of it as there is room for.
std::string shortened(std::string title, double room) {
  if (PlotCanvas::text_width(title, kTitleHeight) <= room) return title;
  while (!title.empty() && PlotCanvas::text_width(title + "...", kTitleHeight) > room) title.pop_back();
  return title + "...";
}

}  // namespace

cv::Mat draw_trajectory(const Trajectory& ground_truth, const Trajectory& estimate, const AteResult& ate,
                        const TrajectoryPlotStyle& style) {
  constexpr double left = 100, right = 55, top = 52, bottom = 58, between = 66;
  constexpr double strip_share = 0.2;
  const int width = std::max(style.width, 600), height = std::max(style.height, 500);
  PlotCanvas canvas(width, height);
  const double strip = strip_share * (height - top - bottom - between);
  const double main = height - top - bottom - between - strip;
  draw_paths(canvas, {left, top, width - left - right, main}, ground_truth, estimate, ate);
  draw_errors(canvas, {left, top + main + between, width - left - right, strip}, ate);

  const std::string figures =
      fmt::format("ATE rmse {:.4f} m, max {:.4f} m, {} poses", ate.rmse, ate.max, ate.pairs);
  const double room = width - left - right - PlotCanvas::text_width(figures, kTitleHeight) - kTitleHeight;
  canvas.text(shortened(style.title, room), {left, 0.5 * top}, kTitleHeight, kText);
  canvas.text(figures, {width - right, 0.5 * top}, kTitleHeight, kText, Anchor::kRight);
  return canvas.picture();
}

void write_trajectory_plot(const std::filesystem::path& file, const Trajectory& ground_truth,
                           const Trajectory& estimate, const AteResult& ate,
                           const TrajectoryPlotStyle& style) {
  write_image_atomically(file, draw_trajectory(ground_truth, estimate, ate, style));
}

}  // namespace ipl_slam
