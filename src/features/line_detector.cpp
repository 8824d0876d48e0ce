#include "features/line_detector.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <stdexcept>

#include <opencv2/imgproc.hpp>

namespace ipl_slam {
namespace {

using Eigen::Vector2d;

constexpr int kMinSide = 16;  // pixels; octaves smaller than this hold no segment worth having
// Many cameras deliver a dark last row (TUM's do): a long line that moves with the camera. Pixels.
constexpr int kBorder = 2;
// To either side of an edge, beyond the blur of lens and sensor. Pixels.
constexpr double kContrastReach = 1.5;
constexpr double kContrastStep = 2.0;  // between samples along an edge, pixels

// Full size first, without the outermost pixels.
std::vector<cv::Mat> pyramid_of(const cv::Mat& grey, int octaves) {
  std::vector<cv::Mat> images;
  const cv::Rect inside(kBorder, kBorder, grey.cols - 2 * kBorder, grey.rows - 2 * kBorder);
  if (std::min(inside.width, inside.height) < kMinSide) return images;
  images.push_back(grey(inside).clone());  // a part of an image would let OpenCV look beyond its border
  while (images.size() < static_cast<std::size_t>(octaves)) {
    cv::Mat half;
    cv::pyrDown(images.back(), half);
    if (std::min(half.rows, half.cols) < kMinSide) break;
    images.push_back(half);
  }
  return images;
}

// Pixels of an octave of the pyramid and of the full image. cv::pyrDown keeps the centre of pixel 0 in its
// place.
Vector2d to_full(const Vector2d& p, int octave) {
  return std::ldexp(1.0, octave) * p + Vector2d(kBorder, kBorder);
}
Vector2d to_octave(const Vector2d& p, int octave) {
  return std::ldexp(1.0, -octave) * (p - Vector2d(kBorder, kBorder));
}

// Grey value between pixels; beyond the border that of the border.
double sample(const cv::Mat& grey, const Vector2d& p) {
  const double u = std::clamp(p.x(), 0.0, grey.cols - 1.001), v = std::clamp(p.y(), 0.0, grey.rows - 1.001);
  const int x = static_cast<int>(u), y = static_cast<int>(v);
  const double a = u - x, b = v - y;
  const auto *upper = grey.ptr(y) + x, *lower = grey.ptr(y + 1) + x;
  return (1.0 - b) * ((1.0 - a) * upper[0] + a * upper[1]) + b * ((1.0 - a) * lower[0] + a * lower[1]);
}

LineSegment segment_between(const Vector2d& start, const Vector2d& end, int octave) {
  LineSegment s;
  s.start = start.cast<float>();
  s.end = end.cast<float>();
  s.octave = octave;
  return s;
}

}  // namespace

LineDetector::LineDetector(LineMethod method, const LineDetectorOptions& options, const Camera& camera)
    : method_(method), options_(options), camera_(camera), undistort_(camera) {}

// OpenCV's LSD has the brighter side on the left. It works on the image shrunk to 0.8 of its size and divides
// its coordinates by that, though the centre of pixel x of the shrunk image lies at (x + 0.5) / 0.8 - 0.5.
void LineDetector::find_lsd(const cv::Mat& image, int octave, std::vector<LineSegment>& pieces) const {
  constexpr double kShrink = 0.8, kShift = 0.5 / kShrink - 0.5;
  std::vector<cv::Vec4f> lines;
  cv::createLineSegmentDetector(cv::LSD_REFINE_STD, kShrink)->detect(image, lines);
  for (const cv::Vec4f& l : lines) {
    const Vector2d end(l[0] + kShift, l[1] + kShift), start(l[2] + kShift, l[3] + kShift);
    if ((end - start).norm() < options_.min_piece) continue;
    pieces.push_back(segment_between(camera_.undistort(to_full(start, octave)),
                                     camera_.undistort(to_full(end, octave)), octave));
  }
}

// Points are undistorted before lines are fitted to them, so that the lens does not break straight edges.
void LineDetector::find_edges(const cv::Mat& image, int octave, std::vector<LineSegment>& pieces) {
  const auto units = [](double gradient) {
    return static_cast<int>(std::lround(gradient * kEdgeGradientUnit));
  };
  EdgeMap& map = maps_[static_cast<std::size_t>(octave)];
  compute_edge_map(image, units(options_.edges.anchor_gradient), map);
  chain_finder_.find(map, units(options_.edges.min_gradient),
                     static_cast<std::size_t>(options_.edges.pieces.seed_points), chains_);
  const double pixel = std::ldexp(1.0, octave);
  for (EdgePoint& p : chains_.points) {
    const Eigen::Vector2f q = undistort_(to_full(Vector2d(p.u, p.v), octave).cast<float>());
    p.u = q.x();
    p.v = q.y();
  }
  std::vector<StraightPiece> straight;
  for (std::size_t k = 0; k + 1 < chains_.begins.size(); ++k) {
    const std::size_t begin = chains_.begins[k], size = chains_.begins[k + 1] - begin;
    split_chain(std::span(chains_.points).subspan(begin, size), pixel, options_.edges.pieces, straight);
  }
  for (const StraightPiece& p : straight) {
    if ((p.end - p.start).norm() < pixel * options_.min_piece) continue;
    pieces.push_back(segment_between(p.start, p.end, octave));
  }
}

// Mean grey value on the right minus that on the left, in the image of the segment's octave.
float LineDetector::contrast(const cv::Mat& image, const LineSegment& segment) const {
  const double pixel = std::ldexp(1.0, segment.octave);
  const Vector2d start = segment.start.cast<double>(), run = segment.end.cast<double>() - start;
  const Vector2d right = Vector2d(-run.y(), run.x()).normalized() * kContrastReach * pixel;
  const int samples = std::max(2, static_cast<int>(run.norm() / (kContrastStep * pixel)));
  double sum = 0.0;
  for (int i = 0; i < samples; ++i) {
    const Vector2d p = start + (i + 0.5) / samples * run;
    sum += sample(image, to_octave(camera_.distort(p + right), segment.octave)) -
           sample(image, to_octave(camera_.distort(p - right), segment.octave));
  }
  return static_cast<float>(sum / samples);
}

std::vector<LineSegment> LineDetector::detect(const cv::Mat& grey) {
  if (grey.type() != CV_8UC1 || grey.cols != camera_.width || grey.rows != camera_.height) {
    throw std::invalid_argument("LineDetector::detect: an 8-bit grey image of the camera's size is needed");
  }
  const std::vector<cv::Mat> pyramid = pyramid_of(grey, options_.octaves);
  maps_.resize(pyramid.size());
  std::vector<LineSegment> pieces;
  for (std::size_t octave = 0; octave < pyramid.size(); ++octave) {
    if (method_ == LineMethod::kLsd) find_lsd(pyramid[octave], static_cast<int>(octave), pieces);
    if (method_ == LineMethod::kEdges) find_edges(pyramid[octave], static_cast<int>(octave), pieces);
  }
  std::vector<LineSegment> kept;
  for (LineSegment& s : join_segments(pieces, options_.joiner)) {
    if (s.length() < options_.min_length || kept.size() == static_cast<std::size_t>(options_.max_segments))
      break;
    s.contrast = contrast(pyramid[static_cast<std::size_t>(s.octave)], s);
    if (s.contrast <= 0.0F || s.contrast < options_.min_contrast) continue;
    s.start_pixel = camera_.distort(s.start.cast<double>()).cast<float>();
    s.end_pixel = camera_.distort(s.end.cast<double>()).cast<float>();
    kept.push_back(s);
  }
  return kept;
}

}  // namespace ipl_slam
