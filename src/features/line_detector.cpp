#include "features/line_detector.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <opencv2/imgproc.hpp>

namespace ipl_slam {
namespace {

constexpr int kMinSide = 16;  // pixels; octaves smaller than this hold no segment worth having
constexpr double kContrastReach =
    1.5;                               // pixels to either side of an edge, beyond the blur of lens and sensor
constexpr double kContrastStep = 2.0;  // pixels between samples along an edge

// A segment in the pixels of one octave.
struct RawSegment {
  Eigen::Vector2d start, end;
};

// OpenCV's LSD works on the image shrunk to 0.8 of its size and divides its coordinates by that, though the
// centre of pixel x of the shrunk image lies at (x + 0.5) / 0.8 - 0.5.
constexpr double kLsdScale = 0.8;
constexpr double kLsdShift = 0.5 / kLsdScale - 0.5;

std::vector<RawSegment> find_lsd(const cv::Mat& grey) {
  std::vector<cv::Vec4f> lines;
  cv::createLineSegmentDetector(cv::LSD_REFINE_STD, kLsdScale)->detect(grey, lines);
  std::vector<RawSegment> segments;
  segments.reserve(lines.size());
  const Eigen::Vector2d shift(kLsdShift, kLsdShift);
  for (const cv::Vec4f& l : lines) {
    segments.push_back({Eigen::Vector2d(l[0], l[1]) + shift, Eigen::Vector2d(l[2], l[3]) + shift});
  }
  return segments;
}

// Grey value between pixels; beyond the border that of the border.
double sample(const cv::Mat& grey, const Eigen::Vector2d& p) {
  const double u = std::clamp(p.x(), 0.0, grey.cols - 1.001), v = std::clamp(p.y(), 0.0, grey.rows - 1.001);
  const int x = static_cast<int>(u), y = static_cast<int>(v);
  const double a = u - x, b = v - y;
  const auto *upper = grey.ptr(y) + x, *lower = grey.ptr(y + 1) + x;
  return (1.0 - b) * ((1.0 - a) * upper[0] + a * upper[1]) + b * ((1.0 - a) * lower[0] + a * lower[1]);
}

// Mean grey value on the right minus that on the left.
double step_across(const cv::Mat& grey, const RawSegment& s) {
  const Eigen::Vector2d run = s.end - s.start;
  const Eigen::Vector2d right = Eigen::Vector2d(-run.y(), run.x()).normalized() * kContrastReach;
  const int samples = std::max(2, static_cast<int>(run.norm() / kContrastStep));
  double sum = 0.0;
  for (int i = 0; i < samples; ++i) {
    const Eigen::Vector2d p = s.start + (i + 0.5) / samples * run;
    sum += sample(grey, p + right) - sample(grey, p - right);
  }
  return sum / samples;
}

}  // namespace

LineDetector::LineDetector(LineMethod method, const LineDetectorOptions& options, const Camera& camera)
    : method_(method), options_(options), camera_(camera) {}

std::vector<LineSegment> LineDetector::detect(const cv::Mat& grey) {
  if (grey.type() != CV_8UC1 || grey.cols != camera_.width || grey.rows != camera_.height) {
    throw std::invalid_argument("LineDetector::detect: an 8-bit grey image of the camera's size is needed");
  }
  std::vector<LineSegment> segments;
  cv::Mat image = grey;
  for (int octave = 0; octave < options_.octaves && std::min(image.rows, image.cols) >= kMinSide; ++octave) {
    for (RawSegment& raw : find_lsd(image)) {
      const double step = step_across(image, raw);
      if (std::abs(step) < options_.min_contrast) continue;
      if (step < 0.0) std::swap(raw.start, raw.end);
      const double scale = std::ldexp(1.0, octave);  // pyrDown keeps pixel 0 in its place
      LineSegment s;
      s.start = camera_.undistort(scale * raw.start).cast<float>();
      s.end = camera_.undistort(scale * raw.end).cast<float>();
      s.contrast = static_cast<float>(std::abs(step));
      s.octave = octave;
      segments.push_back(s);
    }
    cv::Mat half;
    cv::pyrDown(image, half);
    image = half;
  }
  segments = join_segments(std::move(segments), options_.joiner);
  const auto too_short = [&](const LineSegment& s) { return s.length() < options_.min_length; };
  segments.erase(std::find_if(segments.begin(), segments.end(), too_short), segments.end());
  if (segments.size() > static_cast<std::size_t>(options_.max_segments)) {
    segments.resize(static_cast<std::size_t>(options_.max_segments));
  }
  for (LineSegment& s : segments) {
    s.start_pixel = camera_.distort(s.start.cast<double>()).cast<float>();
    s.end_pixel = camera_.distort(s.end.cast<double>()).cast<float>();
  }
  return segments;
}

}  // namespace ipl_slam
