#include "pipeline/feature_overlay.hpp"

#include <cmath>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "pipeline/weight_colors.hpp"

namespace ipl_slam {
namespace {

constexpr int kShift = 4;  // positions are drawn to 1/16 pixel
const cv::Scalar kEnd(255, 230, 170), kRim(25, 25, 25);

cv::Point fixed_point(const Eigen::Vector2d& uv) {
  constexpr double kOne = 1 << kShift;
  return {static_cast<int>(std::lround(uv.x() * kOne)), static_cast<int>(std::lround(uv.y() * kOne))};
}

void draw_dot(cv::Mat& picture, const Eigen::Vector2d& uv, int radius, const cv::Scalar& color) {
  cv::circle(picture, fixed_point(uv), radius << kShift, color, cv::FILLED, cv::LINE_AA, kShift);
}

void draw_cross(cv::Mat& picture, const Eigen::Vector2d& uv) {
  constexpr double kArm = 3.0;
  for (const double slope : {1.0, -1.0}) {
    const Eigen::Vector2d arm(kArm, slope * kArm);
    cv::line(picture, fixed_point(uv - arm), fixed_point(uv + arm), point_color(0.0), 1, cv::LINE_AA, kShift);
  }
}

void draw_points(cv::Mat& picture, const TrackedFrame& frame, const FeatureWeights& weights) {
  for (const bool matched : {false, true}) {  // the matched ones on top
    for (std::size_t k = 0; k < frame.points.size(); ++k) {
      if (frame.points[k].valid() != matched) continue;
      const Eigen::Vector2d uv = frame.frame->features.keypoints[k].pixel.cast<double>();
      const double weight = weights.point(k);
      if (weight <= 0.0) {
        draw_cross(picture, uv);
      } else if (matched) {
        draw_dot(picture, uv, 3, kRim);  // tells its colour from that of a tinted region
        draw_dot(picture, uv, 2, point_color(weight));
      } else {
        draw_dot(picture, uv, 1, kUnmatchedColor);
      }
    }
  }
}

void draw_line(cv::Mat& picture, const SeenLine& line, const Camera& camera) {
  constexpr int kPieces = 8;
  std::vector<cv::Point> curve;
  for (int i = 0; i <= kPieces; ++i) {
    const Eigen::Vector2d uv = line.start + (line.end - line.start) * (static_cast<double>(i) / kPieces);
    curve.push_back(fixed_point(camera.distort(uv)));
  }
  cv::polylines(picture, curve, false, line_color(line.weight), 2, cv::LINE_AA, kShift);
  for (const cv::Point& end : {curve.front(), curve.back()}) {
    cv::circle(picture, end, 2 << kShift, kEnd, cv::FILLED, cv::LINE_AA, kShift);
  }
}

void draw_words(cv::Mat& picture, const char* words, const cv::Point& at) {
  cv::putText(picture, words, at, cv::FONT_HERSHEY_SIMPLEX, 0.36, cv::Scalar::all(235), 1, cv::LINE_AA);
}

// "name 0 [colours] 1", 12 pixels high.
void draw_scale(cv::Mat& picture, const char* name, cv::Scalar (*color)(double), const cv::Point& at) {
  constexpr int kBar = 60;
  draw_words(picture, name, at + cv::Point(0, 9));
  draw_words(picture, "0", at + cv::Point(42, 9));
  for (int i = 0; i < kBar; ++i) {
    const cv::Point top = at + cv::Point(53 + i, 2);
    cv::line(picture, top, top + cv::Point(0, 6), color(i / (kBar - 1.0)), 1);
  }
  draw_words(picture, "1", at + cv::Point(56 + kBar, 9));
}

// In the lower left corner; left out where it would hide much of the picture.
void draw_legend(cv::Mat& picture) {
  constexpr int kWidth = 140, kHeight = 44, kMargin = 4;
  if (picture.cols < 2 * kWidth || picture.rows < 4 * kHeight) return;
  const cv::Rect box(kMargin, picture.rows - kHeight - kMargin, kWidth, kHeight);
  picture(box) *= 0.35;
  const cv::Point corner = box.tl() + cv::Point(4, 2);
  draw_scale(picture, "points", point_color, corner);
  draw_scale(picture, "lines", line_color, corner + cv::Point(0, 13));
  const Eigen::Vector2d row(corner.x, corner.y + 33);
  draw_cross(picture, row + Eigen::Vector2d(4, 0));
  draw_words(picture, "removed", corner + cv::Point(11, 36));
  draw_dot(picture, row + Eigen::Vector2d(67, 0), 1, kUnmatchedColor);
  draw_words(picture, "no match", corner + cv::Point(72, 36));
}

}  // namespace

void draw_features(cv::Mat& picture, const TrackedFrame& frame, const FeatureWeights& weights,
                   const Camera& camera) {
  if (!frame.frame) return;
  draw_points(picture, frame, weights);
  for (const SeenLine& line : frame.lines) draw_line(picture, line, camera);
  draw_legend(picture);
}

}  // namespace ipl_slam
