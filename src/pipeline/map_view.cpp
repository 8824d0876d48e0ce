#include "pipeline/map_view.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace ipl_slam {
namespace {

constexpr int kSize = 900, kMargin = 40;
const cv::Scalar kGrid(225, 225, 225), kText(120, 120, 120), kPath(180, 90, 20), kKeyframe(40, 40, 200);

// World x to the right, z upwards in the picture.
class Projection {
 public:
  Projection(cv::Point2d low, cv::Point2d high) {
    const double extent = std::max({high.x - low.x, high.y - low.y, 0.5});
    scale_ = (kSize - 2 * kMargin) / extent;
    centre_ = 0.5 * (low + high);
  }
  [[nodiscard]] cv::Point operator()(double x, double z) const {
    return {cvRound(0.5 * kSize + (x - centre_.x) * scale_), cvRound(0.5 * kSize - (z - centre_.y) * scale_)};
  }
  [[nodiscard]] double metres(int pixels) const { return pixels / scale_; }
  [[nodiscard]] cv::Point2d centre() const { return centre_; }

 private:
  double scale_;
  cv::Point2d centre_;
};

// Bounds that a few stray landmarks cannot blow up: the 1st to 99th percentile, and the whole path.
Projection fit(const Map& map, const Trajectory& path) {
  std::vector<double> xs, zs;
  map.points().for_each([&](PointId, const Point& p) {
    xs.push_back(p.position.x());
    zs.push_back(p.position.z());
  });
  const auto bound = [](std::vector<double>& v, double share) {
    if (v.empty()) return 0.0;
    const auto nth = v.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(v.size() - 1));
    std::nth_element(v.begin(), nth, v.end());
    return *nth;
  };
  cv::Point2d low(bound(xs, 0.01), bound(zs, 0.01)), high(bound(xs, 0.99), bound(zs, 0.99));
  for (const StampedPose& pose : path) {
    const Eigen::Vector3d& t = pose.T_wc.translation();
    low = {std::min(low.x, t.x()), std::min(low.y, t.z())};
    high = {std::max(high.x, t.x()), std::max(high.y, t.z())};
  }
  return {low, high};
}

void draw_grid(cv::Mat& image, const Projection& project) {
  const double half = project.metres(kSize / 2);
  const double step = half > 8.0 ? 5.0 : half > 2.0 ? 1.0 : 0.25;
  const cv::Point2d c = project.centre();
  for (double v = std::ceil((c.x - half) / step) * step; v < c.x + half; v += step) {
    const int x = project(v, 0.0).x;
    cv::line(image, {x, 0}, {x, kSize}, kGrid);
    cv::putText(image, fmt::format("{:g} m", v + 0.0), {x + 3, kSize - 6}, cv::FONT_HERSHEY_SIMPLEX, 0.4,
                kText, 1, cv::LINE_AA);
  }
  for (double v = std::ceil((c.y - half) / step) * step; v < c.y + half; v += step) {
    const int y = project(0.0, v).y;
    cv::line(image, {0, y}, {kSize, y}, kGrid);
    cv::putText(image, fmt::format("{:g} m", v + 0.0), {4, y - 3}, cv::FONT_HERSHEY_SIMPLEX, 0.4, kText, 1,
                cv::LINE_AA);
  }
}

void draw_keyframe(cv::Mat& image, const Projection& project, const SE3& T_wc) {
  const double size = project.metres(9);
  std::vector<cv::Point> triangle;
  for (const Eigen::Vector3d& corner :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(-0.6, 0, 1), Eigen::Vector3d(0.6, 0, 1)}) {
    const Eigen::Vector3d p = T_wc * Eigen::Vector3d(size * corner);
    triangle.push_back(project(p.x(), p.z()));
  }
  cv::polylines(image, triangle, true, kKeyframe, 1, cv::LINE_AA);
}

}  // namespace

cv::Mat draw_map_view(const Map& map, const Trajectory& path) {
  cv::Mat image(kSize, kSize, CV_8UC3, cv::Scalar::all(255));
  const Projection project = fit(map, path);
  draw_grid(image, project);
  map.points().for_each([&](PointId, const Point& p) {
    const int shade = std::clamp(static_cast<int>(60.0 + 70.0 * std::abs(p.position.y())), 60, 200);
    cv::circle(image, project(p.position.x(), p.position.z()), 1, cv::Scalar::all(shade), cv::FILLED);
  });
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Eigen::Vector3d &a = path[i - 1].T_wc.translation(), &b = path[i].T_wc.translation();
    cv::line(image, project(a.x(), a.z()), project(b.x(), b.z()), kPath, 2, cv::LINE_AA);
  }
  map.keyframes().for_each(
      [&](KeyframeId, const Keyframe& keyframe) { draw_keyframe(image, project, keyframe.T_cw.inverse()); });
  cv::putText(
      image,
      fmt::format("{} landmarks, {} keyframes, seen from above", map.points().size(), map.keyframes().size()),
      {kMargin, 24}, cv::FONT_HERSHEY_SIMPLEX, 0.55, cv::Scalar::all(40), 1, cv::LINE_AA);
  return image;
}

}  // namespace ipl_slam
