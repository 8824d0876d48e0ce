#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "features/line_features.hpp"
#include "geometry/camera.hpp"
#include "geometry/line3.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam::testing {

/// Lines of one view with what is truly known about it.
struct LineView {
  LineFeatures lines;
  cv::Mat depth;  ///< CV_32FC1, metres, 0 = not known
  SE3 T_wc;
};

/// End points of a piece of a line.
template <class Vector>
struct Piece {
  Vector start, end;
};

/// Nearest depth in the 5x5 pixels around: an edge between near and far belongs to what is near.
inline float near_depth(const cv::Mat& depth, const Eigen::Vector2d& pixel) {
  const int u = static_cast<int>(std::lround(pixel.x())), v = static_cast<int>(std::lround(pixel.y()));
  float nearest = 0.0F;
  for (int y = std::max(0, v - 2); y <= std::min(depth.rows - 1, v + 2); ++y) {
    for (int x = std::max(0, u - 2); x <= std::min(depth.cols - 1, u + 2); ++x) {
      const float z = depth.at<float>(y, x);
      if (z > 0.0F && (nearest == 0.0F || z < nearest)) nearest = z;
    }
  }
  return nearest;
}

/// Where the segment lies in its camera's frame: the affine inverse depth that most samples along it agree
/// with. Nothing where less than 60 % of them do.
inline std::optional<Piece<Eigen::Vector3d>> in_space(const LineView& view, const Camera& camera,
                                                      std::size_t index) {
  constexpr int kSamples = 24;
  constexpr double kAgreement = 0.02;  // of the inverse depth: 3 cm at 1.5 m, what a depth camera gives
  const LineSegment& s = view.lines.segments[index];
  const Eigen::Vector2d start = s.start.cast<double>(), end = s.end.cast<double>();
  std::vector<std::pair<double, double>> samples;  // position 0..1, inverse depth
  for (int i = 0; i < kSamples; ++i) {
    const double t = (i + 0.5) / kSamples;
    const float z = near_depth(view.depth, camera.distort(start + t * (end - start)));
    if (z > 0.0F) samples.emplace_back(t, 1.0 / z);
  }
  int best = 0;
  double w_start = 0.0, w_end = 0.0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    for (std::size_t j = i + 4; j < samples.size(); ++j) {
      const double slope = (samples[j].second - samples[i].second) / (samples[j].first - samples[i].first);
      const double at_start = samples[i].second - slope * samples[i].first;
      const auto agree = std::count_if(samples.begin(), samples.end(), [&](const auto& p) {
        return std::abs(at_start + slope * p.first - p.second) < kAgreement * p.second;
      });
      if (agree <= best || at_start <= 0.0 || at_start + slope <= 0.0) continue;
      best = static_cast<int>(agree), w_start = at_start, w_end = at_start + slope;
    }
  }
  if (best < 0.6 * kSamples) return std::nullopt;
  return Piece<Eigen::Vector3d>{camera.unproject(start, 1.0 / w_start), camera.unproject(end, 1.0 / w_end)};
}

/// Where the segment of `a` shows in `b`, undistorted pixels.
inline std::optional<Piece<Eigen::Vector2d>> carried(const LineView& a, const LineView& b,
                                                     const Camera& camera, std::size_t index) {
  const auto piece = in_space(a, camera, index);
  if (!piece) return std::nullopt;
  const SE3 T_ba = b.T_wc.inverse() * a.T_wc;
  const Eigen::Vector3d start = T_ba * piece->start, end = T_ba * piece->end;
  if (start.z() < 0.1 || end.z() < 0.1) return std::nullopt;
  return Piece<Eigen::Vector2d>{camera.project(start), camera.project(end)};
}

/// Whether the segment is what was carried: same direction, a quarter of the shorter of the two in common, and
/// the ends of the shorter within `tolerance` pixels of the line of the longer.
inline bool is_same(const Piece<Eigen::Vector2d>& carried, const LineSegment& segment, double tolerance) {
  Piece<Eigen::Vector2d> shorter = carried, longer{segment.start.cast<double>(), segment.end.cast<double>()};
  const double carried_length = (carried.end - carried.start).norm();
  const double own_length = static_cast<double>(segment.length());
  if (carried_length > own_length) std::swap(shorter, longer);
  const auto line = image_line(longer.start, longer.end);
  if (!line) return false;
  const double length = std::max(carried_length, own_length);
  const Eigen::Vector2d direction = (longer.end - longer.start) / length;
  const double from = direction.dot(shorter.start - longer.start), to = direction.dot(shorter.end - longer.start);
  const double overlap = std::min(to, length) - std::max(from, 0.0);
  return to > from && overlap >= 0.25 * (shorter.end - shorter.start).norm() &&
         std::abs(signed_distance(*line, shorter.start)) <= tolerance &&
         std::abs(signed_distance(*line, shorter.end)) <= tolerance;
}

/// How many matches are right, and how many there were to find.
struct MatchScore {
  int right = 0, judged = 0;  ///< matches; judged are those whose place in space is known
  int found = 0, there = 0;   ///< segments of a with a true counterpart in b; those of them matched rightly

  [[nodiscard]] double precision() const { return judged == 0 ? 0.0 : static_cast<double>(right) / judged; }
  [[nodiscard]] double recall() const { return there == 0 ? 0.0 : static_cast<double>(found) / there; }
};

inline void add_score(const LineView& a, const LineView& b, const Camera& camera, double tolerance,
                      const std::vector<std::pair<int, int>>& matches, MatchScore& score) {
  std::vector<int> match_of(a.lines.size(), -1);
  for (const auto& [i, j] : matches) match_of[static_cast<std::size_t>(i)] = j;
  for (std::size_t i = 0; i < a.lines.size(); ++i) {
    const auto piece = carried(a, b, camera, i);
    if (!piece) continue;
    const auto right = [&](const LineSegment& s) { return is_same(*piece, s, tolerance); };
    const int j = match_of[i];
    const bool is_right = j >= 0 && right(b.lines.segments[static_cast<std::size_t>(j)]);
    score.judged += j >= 0 ? 1 : 0;
    score.right += is_right ? 1 : 0;
    if (!std::any_of(b.lines.segments.begin(), b.lines.segments.end(), right)) continue;
    ++score.there;
    score.found += is_right ? 1 : 0;
  }
}

}  // namespace ipl_slam::testing
