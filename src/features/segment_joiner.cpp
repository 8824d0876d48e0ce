#include "features/segment_joiner.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include <Eigen/Core>

namespace ipl_slam {
namespace {

using Eigen::Vector2d;

constexpr double kDuplicateOverlap = 0.5;  // of its length

// A line through `point` along the unit vector `direction`.
struct Axis {
  Vector2d point, direction;

  [[nodiscard]] double along(const Vector2d& p) const { return direction.dot(p - point); }
  [[nodiscard]] double offset(const Vector2d& p) const {
    const Vector2d d = p - point;
    return std::abs(direction.x() * d.y() - direction.y() * d.x());
  }
};

// Pieces of one edge, as mass spread evenly along each of them. A piece's mass is its length over the
// variance of its position, 4^octave.
class Edge {
 public:
  explicit Edge(const LineSegment& s)
      : axis_{s.start.cast<double>(), (s.end - s.start).cast<double>().normalized()},
        length_((s.end - s.start).cast<double>().norm()),
        octave_(s.octave),
        coarsest_(s.octave),
        mass_(std::ldexp(length_, -2 * s.octave)),
        heaviest_(mass_),
        points_{{start(), s.octave}, {end(), s.octave}} {
    const Vector2d half = 0.5 * length_ * axis_.direction, middle = start() + half;
    first_ = mass_ * middle;
    second_ = mass_ * (middle * middle.transpose() + half * half.transpose() / 3.0);
  }

  [[nodiscard]] const Axis& axis() const { return axis_; }  // through the start, towards the end
  [[nodiscard]] const Vector2d& start() const { return axis_.point; }
  [[nodiscard]] Vector2d end() const { return axis_.point + length_ * axis_.direction; }
  [[nodiscard]] Vector2d middle() const { return axis_.point + 0.5 * length_ * axis_.direction; }
  [[nodiscard]] double length() const { return length_; }
  [[nodiscard]] int octave() const { return octave_; }
  [[nodiscard]] int coarsest() const { return coarsest_; }

  // The two as one, whether or not they belong together.
  [[nodiscard]] Edge with(const Edge& other) const {
    Edge sum = *this;
    sum.mass_ += other.mass_;
    sum.first_ += other.first_;
    sum.second_ += other.second_;
    if (other.heaviest_ > heaviest_) sum.octave_ = other.octave_;
    sum.heaviest_ = std::max(heaviest_, other.heaviest_);
    sum.coarsest_ = std::max(coarsest_, other.coarsest_);
    sum.points_.insert(sum.points_.end(), other.points_.begin(), other.points_.end());
    sum.fit();
    return sum;
  }

  // Largest distance of a piece's end point from the edge, in pixels of the octave it was found on.
  [[nodiscard]] double spread() const {
    double largest = 0.0;
    for (const auto& [point, octave] : points_) {
      largest = std::max(largest, std::ldexp(axis_.offset(point), -octave));
    }
    return largest;
  }

  [[nodiscard]] LineSegment segment() const {
    LineSegment s;
    s.start = start().cast<float>();
    s.end = end().cast<float>();
    s.octave = octave_;
    return s;
  }

 private:
  // The principal axis of the mass, cut to what the pieces span.
  void fit() {
    const Vector2d mean = first_ / mass_;
    const Eigen::Matrix2d c = second_ / mass_ - mean * mean.transpose();
    const double angle = 0.5 * std::atan2(2.0 * c(0, 1), c(0, 0) - c(1, 1));
    Axis axis{mean, {std::cos(angle), std::sin(angle)}};
    if (axis.direction.dot(axis_.direction) < 0.0) axis.direction = -axis.direction;
    double low = INFINITY, high = -INFINITY;
    for (const auto& [point, octave] : points_) {
      low = std::min(low, axis.along(point));
      high = std::max(high, axis.along(point));
    }
    axis_ = {axis.point + low * axis.direction, axis.direction};
    length_ = high - low;
  }

  Axis axis_;
  double length_;
  int octave_, coarsest_;   // of the heaviest and of the coarsest piece
  double mass_, heaviest_;  // of all pieces and of the heaviest
  Vector2d first_;          // moments of the mass
  Eigen::Matrix2d second_;
  std::vector<std::pair<Vector2d, int>> points_;  // end points of the pieces and their octaves
};

// Space between the two along `a`; negative where they overlap.
double gap_between(const Edge& a, const Edge& b) {
  return std::max(a.axis().along(b.start()) - a.length(), -a.axis().along(b.end()));
}

// Whether b, the shorter one, is worth a closer look. If all end points lie within max_offset of one line,
// and the gap is less than b's length, then b's middle lies within five times that of a's axis.
bool in_reach(const Edge& a, const Edge& b, double min_cosine, const SegmentJoinerOptions& options) {
  if (a.axis().direction.dot(b.axis().direction) < min_cosine) return false;
  const double reach = std::ldexp(5.0 * options.max_offset, std::max(a.coarsest(), b.coarsest()));
  if (a.axis().offset(b.middle()) > reach) return false;
  const double shorter = std::min(a.length(), b.length());
  return gap_between(a, b) <= std::min(options.max_gap, options.max_gap_ratio * shorter);
}

// Whether b was found along a.
bool duplicates(const Edge& a, const Edge& b, const SegmentJoinerOptions& options) {
  if (a.axis().direction.dot(b.axis().direction) <= 0.0) return false;
  const double reach = std::ldexp(options.duplicate_offset, std::max(a.coarsest(), b.coarsest()));
  if (a.axis().offset(b.start()) > reach || a.axis().offset(b.end()) > reach) return false;
  const double overlap =
      std::min(a.axis().along(b.end()), a.length()) - std::max(a.axis().along(b.start()), 0.0);
  return overlap >= kDuplicateOverlap * b.length();
}

bool longer(const Edge& a, const Edge& b) {
  return a.length() > b.length();
}
bool finer(const Edge& a, const Edge& b) {
  return a.octave() < b.octave();
}

std::vector<Edge> join(std::vector<Edge> pieces, const SegmentJoinerOptions& options) {
  const double min_cosine = std::cos(options.max_angle * std::numbers::pi / 180.0);
  std::stable_sort(pieces.begin(), pieces.end(), longer);
  std::vector<Edge> edges;
  std::vector<bool> used(pieces.size(), false);
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (used[i]) continue;
    Edge edge = std::move(pieces[i]);
    for (std::size_t j = i + 1; j < pieces.size(); ++j) {
      if (used[j] || !in_reach(edge, pieces[j], min_cosine, options)) continue;
      Edge both = edge.with(pieces[j]);
      if (both.spread() > options.max_offset) continue;
      edge = std::move(both);
      used[j] = true;
      j = i;  // what was too far away may be in reach now
    }
    edges.push_back(std::move(edge));
  }
  return edges;
}

// Of edges found twice the finer one stays, on the same octave the longer one.
std::vector<Edge> without_duplicates(std::vector<Edge> edges, const SegmentJoinerOptions& options) {
  std::stable_sort(edges.begin(), edges.end(), longer);
  std::stable_sort(edges.begin(), edges.end(), finer);
  std::vector<Edge> kept;
  for (Edge& edge : edges) {
    const auto duplicates_edge = [&](const Edge& k) { return duplicates(k, edge, options); };
    if (std::none_of(kept.begin(), kept.end(), duplicates_edge)) kept.push_back(std::move(edge));
  }
  return kept;
}

}  // namespace

std::vector<LineSegment> join_segments(std::span<const LineSegment> segments,
                                       const SegmentJoinerOptions& options) {
  const std::vector<Edge> pieces(segments.begin(), segments.end());
  std::vector<LineSegment> result;
  for (const Edge& edge : without_duplicates(join(pieces, options), options)) {
    result.push_back(edge.segment());
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const LineSegment& a, const LineSegment& b) { return a.length() > b.length(); });
  return result;
}

}  // namespace ipl_slam
