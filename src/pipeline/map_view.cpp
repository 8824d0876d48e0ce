#include "pipeline/map_view.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "evaluation/plot_axes.hpp"
#include "map/landmark_part.hpp"

namespace ipl_slam {
namespace {

using namespace plot_style;

constexpr int kWidth = 1000, kHeight = 1000;
const cv::Rect2d kBox(95.0, 50.0, 875.0, 880.0);
const cv::Scalar kLow(150, 90, 60), kHigh(90, 170, 250), kKeyframe(40, 40, 200), kLineColor(200, 200, 150);

double percentile(std::vector<double>& values, double share) {
  if (values.empty()) return 0.0;
  const auto nth =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

// From the 1st to the 99th percentile: a few stray landmarks must not make everything else small.
PlotRange range_of(std::vector<double> values) {
  PlotRange range;
  range.add(percentile(values, 0.01));
  range.add(percentile(values, 0.99));
  return range;
}

void draw_keyframe(PlotCanvas& canvas, const PlotAxes& axes, const SE3& T_wc) {
  const double size = 12.0 * axes.x.extent() / axes.box.width;  // metres that are 12 pixels
  std::vector<cv::Point2d> view;
  for (const Eigen::Vector3d& corner : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(-0.6, 0, 1),
                                        Eigen::Vector3d(0.6, 0, 1), Eigen::Vector3d(0, 0, 0)}) {
    const Eigen::Vector3d p = T_wc * Eigen::Vector3d(size * corner);
    view.push_back(axes.at(p.x(), p.z()));
  }
  canvas.polyline(view, kKeyframe, 1.2);
}

// The part of the line that lies in the box, to a tenth of a picture's pixel.
void draw_map_line(PlotCanvas& canvas, const PlotAxes& axes, const Line& line) {
  constexpr double kParts = 10.0;  // cv::clipLine takes whole numbers
  const auto whole = [&](const Eigen::Vector3d& p) {
    return cv::Point2l((axes.at(p.x(), p.z()) - kBox.tl()) * kParts);
  };
  cv::Point2l from = whole(line.start), to = whole(line.end);
  const cv::Size2l box(std::lround(kBox.width * kParts), std::lround(kBox.height * kParts));
  if (!cv::clipLine(box, from, to)) return;
  const auto back = [&](const cv::Point2l& p) { return kBox.tl() + cv::Point2d(p) / kParts; };
  canvas.polyline({back(from), back(to)}, kLineColor, 1.0);
}

}  // namespace

cv::Mat draw_map_view(const Map& map, const TrajectoryPart& path) {
  const auto shown = [&](PartId part) { return !path.part.valid() || part == path.part; };
  std::size_t points = 0, lines = 0, keyframes = 0;
  std::vector<double> xs, ys, zs;
  map.points().for_each([&](PointId, const Point& p) {
    if (!shown(part_of(map, p))) return;
    ++points;
    xs.push_back(p.position.x());
    ys.push_back(-p.position.y());  // y points down
    zs.push_back(p.position.z());
  });
  map.lines().for_each([&](LineId, const Line& l) {
    if (!shown(part_of(map, l))) return;
    ++lines;
    for (const Eigen::Vector3d& p : {l.start, l.end}) {
      xs.push_back(p.x());
      zs.push_back(p.z());
    }
  });
  PlotRange x = range_of(xs), z = range_of(zs);
  std::vector<cv::Point2d> line;
  for (const StampedPose& pose : path.poses) {
    x.add(pose.T_wc.translation().x());
    z.add(pose.T_wc.translation().z());
  }
  const PlotAxes axes = metric_axes(kBox, x, z);
  const PlotRange height = range_of(ys);

  PlotCanvas canvas(kWidth, kHeight);
  draw_axes(canvas, axes, "x [m], right of the first camera", "z [m], ahead of the first camera");
  map.lines().for_each([&](LineId, const Line& l) {
    if (shown(part_of(map, l))) draw_map_line(canvas, axes, l);
  });
  map.points().for_each([&](PointId, const Point& p) {
    if (!shown(part_of(map, p))) return;
    const cv::Point2d at = axes.at(p.position.x(), p.position.z());
    if (!kBox.contains(at)) return;
    const double share =
        std::clamp((-p.position.y() - height.low) / std::max(height.extent(), 1e-6), 0.0, 1.0);
    canvas.disc(at, 1.3, kLow + share * (kHigh - kLow));
  });
  for (const StampedPose& pose : path.poses)
    line.push_back(axes.at(pose.T_wc.translation().x(), pose.T_wc.translation().z()));
  if (line.size() > 1) canvas.polyline(line, kEstimate, 2.0);
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    if (!shown(keyframe.part)) return;
    ++keyframes;
    draw_keyframe(canvas, axes, keyframe.T_cw.inverse());
  });

  canvas.text(fmt::format("{} points, {} lines, {} keyframes", points, lines, keyframes), {kBox.x, 25.0},
              kTitleHeight, kText);
  const cv::Point2d right(kBox.x + kBox.width, 25.0);
  double offset = 0.0;
  for (const auto& [name, color] : {std::pair("path", kEstimate),
                                    {"keyframe", kKeyframe},
                                    {"line", kLineColor},
                                    {"high", kHigh},
                                    {"low", kLow}}) {
    const cv::Point2d at = right - cv::Point2d(offset, 0);
    canvas.text(name, at, kTextHeight, kText, PlotCanvas::Anchor::kRight);
    offset += PlotCanvas::text_width(name, kTextHeight) + 12.0;
    canvas.disc(right - cv::Point2d(offset - 2.0, 0), 5.0, color);
    offset += 18.0;
  }
  return canvas.picture();
}

}  // namespace ipl_slam
