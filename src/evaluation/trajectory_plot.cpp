#include "evaluation/trajectory_plot.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include <fmt/format.h>

#include "common/atomic_file.hpp"
#include "evaluation/plot_canvas.hpp"

namespace ipl_slam {
namespace {

using Anchor = PlotCanvas::Anchor;

// Blue, green, red.
const cv::Scalar kTruthColor(70, 70, 70), kEstimateColor(196, 104, 24), kErrorColor(60, 50, 225),
    kErrorFill(226, 224, 250), kGridColor(232, 232, 232), kFrameColor(130, 130, 130), kTextColor(40, 40, 40);

constexpr double kTextHeight = 11.0, kTitleHeight = 14.0;
constexpr double kPixelsPerTick = 90.0;

/// An interval of values that grows by what it is shown.
struct Range {
  double low = 0.0, high = 0.0;
  bool empty = true;

  void add(double value) {
    low = empty ? value : std::min(low, value);
    high = empty ? value : std::max(high, value);
    empty = false;
  }
  [[nodiscard]] double extent() const { return high - low; }
  [[nodiscard]] double middle() const { return 0.5 * (low + high); }
  /// Around the same middle, with this extent.
  void stretch_to(double extent) {
    const double center = middle();
    low = center - 0.5 * extent;
    high = center + 0.5 * extent;
  }
};

/// A framed plot with its two axes: maps values to pixels.
struct Axes {
  cv::Rect2d box;
  Range x, y;

  [[nodiscard]] cv::Point2d at(double vx, double vy) const {
    return {box.x + (vx - x.low) / x.extent() * box.width,
            box.y + box.height - (vy - y.low) / y.extent() * box.height};
  }
};

void draw_frame(PlotCanvas& canvas, const Axes& axes, const std::string& x_label, const std::string& y_label,
                double pixels_per_y_tick) {
  const cv::Rect2d& box = axes.box;
  const double bottom = box.y + box.height, right = box.x + box.width;
  const Ticks x_ticks = ticks_between(axes.x.low, axes.x.high, box.width / kPixelsPerTick);
  for (const double value : x_ticks.values) {
    const double px = axes.at(value, axes.y.low).x;
    canvas.line({px, box.y}, {px, bottom}, kGridColor, 1.0);
    canvas.text(fmt::format("{:.{}f}", value, x_ticks.decimals), {px, bottom + 15}, kTextHeight, kTextColor,
                Anchor::kCenter);
  }
  const Ticks y_ticks = ticks_between(axes.y.low, axes.y.high, box.height / pixels_per_y_tick);
  for (const double value : y_ticks.values) {
    const double py = axes.at(axes.x.low, value).y;
    canvas.line({box.x, py}, {right, py}, kGridColor, 1.0);
    canvas.text(fmt::format("{:.{}f}", value, y_ticks.decimals), {box.x - 8, py}, kTextHeight, kTextColor,
                Anchor::kRight);
  }
  canvas.rectangle(box, kFrameColor, 1.0);
  canvas.text(x_label, {box.x + 0.5 * box.width, bottom + 38}, kTextHeight, kTextColor, Anchor::kCenter);
  canvas.upward_text(y_label, {box.x - 72, box.y + 0.5 * box.height}, kTextHeight, kTextColor);
}

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
std::array<int, 2> widest_axes(const std::array<Range, 3>& ranges) {
  int narrowest = 2;  // of equals, z is left out: the view is from above
  for (const int axis : {1, 0}) {
    if (ranges[static_cast<std::size_t>(axis)].extent() <
        ranges[static_cast<std::size_t>(narrowest)].extent()) {
      narrowest = axis;
    }
  }
  return {narrowest == 0 ? 1 : 0, narrowest == 2 ? 1 : 2};
}

/// Axes with the same scale on both that show all of the ranges, with a margin.
Axes metric_axes(const cv::Rect2d& box, Range x, Range y) {
  constexpr double margin = 1.12,
                   least_extent = 0.02;  // metres: a camera that stands still is no division by zero
  const double metres_per_pixel =
      margin * std::max({x.extent() / box.width, y.extent() / box.height, least_extent / box.height});
  x.stretch_to(metres_per_pixel * box.width);
  y.stretch_to(metres_per_pixel * box.height);
  return {box, x, y};
}

void draw_path(PlotCanvas& canvas, const Axes& axes, const std::array<int, 2>& shown, const Path& path,
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
  const std::array<Item, 3> items = {{{"ground truth", kTruthColor, 1.6},
                                      {"estimated", kEstimateColor, 2.2},
                                      {"difference", kErrorColor, 1.2}}};
  constexpr double row = 21.0, sample = 34.0, padding = 11.0;
  const double width = 2.5 * padding + sample + PlotCanvas::text_width("ground truth", kTextHeight);
  const cv::Rect2d box(plot.x + plot.width - width - 12, plot.y + 12, width, padding + row * items.size());
  canvas.fill(box, cv::Scalar::all(255));
  canvas.rectangle(box, kGridColor, 1.0);
  for (std::size_t i = 0; i < items.size(); ++i) {
    const double y = box.y + 0.5 * padding + row * (static_cast<double>(i) + 0.5);
    canvas.line({box.x + padding, y}, {box.x + padding + sample, y}, items[i].color, items[i].thickness);
    canvas.text(items[i].name, {box.x + 1.5 * padding + sample, y}, kTextHeight, kTextColor);
  }
}

void draw_paths(PlotCanvas& canvas, const cv::Rect2d& box, const Trajectory& ground_truth,
                const Trajectory& estimate, const AteResult& ate) {
  const Path truth = path_of(ground_truth, SE3()), estimated = path_of(estimate, ate.T_ge);
  std::array<Range, 3> ranges;
  for (const Path* path : {&truth, &estimated}) {
    for (const Eigen::Vector3d& p : path->positions) {
      for (std::size_t axis = 0; axis < 3; ++axis) ranges[axis].add(p[static_cast<int>(axis)]);
    }
  }
  const std::array<int, 2> shown = widest_axes(ranges);
  const Axes axes = metric_axes(box, ranges[static_cast<std::size_t>(shown[0])],
                                ranges[static_cast<std::size_t>(shown[1])]);
  constexpr const char* names = "xyz";
  draw_frame(canvas, axes, fmt::format("{} [m]", names[shown[0]]), fmt::format("{} [m]", names[shown[1]]),
             kPixelsPerTick * 0.8);
  draw_path(canvas, axes, shown, truth, kTruthColor, 1.6);
  for (const AlignedPair& pair : ate.aligned) {
    canvas.line(axes.at(pair.truth[shown[0]], pair.truth[shown[1]]),
                axes.at(pair.estimate[shown[0]], pair.estimate[shown[1]]), kErrorColor, 1.2);
  }
  draw_path(canvas, axes, shown, estimated, kEstimateColor, 2.2);
  draw_legend(canvas, box);
}

void draw_errors(PlotCanvas& canvas, const cv::Rect2d& box, const AteResult& ate) {
  constexpr double headroom = 1.12, least_error = 1e-3, least_time = 1e-3;  // metres, seconds: no empty axis
  const double start = ate.aligned.front().timestamp;
  const double end = std::max(ate.aligned.back().timestamp - start, least_time);
  const Axes axes{box, {0.0, end, false}, {0.0, headroom * std::max(ate.max, least_error), false}};
  draw_frame(canvas, axes, "time [s]", "error [m]", 38.0);

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
    canvas.polyline(piece, kErrorColor, 1.4);
  }
  canvas.dashed_line(axes.at(0.0, ate.rmse), axes.at(end, ate.rmse), kFrameColor, 1.2);
  canvas.text("rmse", axes.at(end, ate.rmse) + cv::Point2d(7, 0), kTextHeight, kFrameColor);
  canvas.rectangle(box, kFrameColor, 1.0);
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
  canvas.text(shortened(style.title, room), {left, 0.5 * top}, kTitleHeight, kTextColor);
  canvas.text(figures, {width - right, 0.5 * top}, kTitleHeight, kTextColor, Anchor::kRight);
  return canvas.picture();
}

void write_trajectory_plot(const std::filesystem::path& file, const Trajectory& ground_truth,
                           const Trajectory& estimate, const AteResult& ate,
                           const TrajectoryPlotStyle& style) {
  write_image_atomically(file, draw_trajectory(ground_truth, estimate, ate, style));
}

}  // namespace ipl_slam
