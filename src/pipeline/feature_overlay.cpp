#include "pipeline/feature_overlay.hpp"

#include <cmath>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace ipl_slam {
namespace {

constexpr int kShift = 4;  // positions are drawn to 1/16 pixel
const cv::Scalar kMatched(90, 220, 60), kUnmatched(150, 150, 150), kLine(255, 140, 20), kEnd(255, 230, 170);

cv::Point fixed_point(const Eigen::Vector2d& uv) {
  constexpr double kOne = 1 << kShift;
  return {static_cast<int>(std::lround(uv.x() * kOne)), static_cast<int>(std::lround(uv.y() * kOne))};
}

void draw_line(cv::Mat& picture, const SeenLine& line, const Camera& camera) {
  constexpr int kPieces = 8;
  std::vector<cv::Point> curve;
  for (int i = 0; i <= kPieces; ++i) {
    const Eigen::Vector2d uv = line.start + (line.end - line.start) * (static_cast<double>(i) / kPieces);
    curve.push_back(fixed_point(camera.distort(uv)));
  }
  cv::polylines(picture, curve, false, kLine, 2, cv::LINE_AA, kShift);
  for (const cv::Point& end : {curve.front(), curve.back()}) {
    cv::circle(picture, end, 2 << kShift, kEnd, cv::FILLED, cv::LINE_AA, kShift);
  }
}

}  // namespace

void draw_features(cv::Mat& picture, const TrackedFrame& frame, const Camera& camera) {
  if (!frame.frame) return;
  for (const bool matched : {false, true}) {  // the matched ones on top
    for (std::size_t k = 0; k < frame.points.size(); ++k) {
      if (frame.points[k].valid() != matched) continue;
      const cv::Point at = fixed_point(frame.frame->features.keypoints[k].pixel.cast<double>());
      cv::circle(picture, at, (matched ? 2 : 1) << kShift, matched ? kMatched : kUnmatched, cv::FILLED,
                 cv::LINE_AA, kShift);
    }
  }
  for (const SeenLine& line : frame.lines) draw_line(picture, line, camera);
}

}  // namespace ipl_slam
