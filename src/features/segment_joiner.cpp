#include "features/segment_joiner.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <utility>

#include <Eigen/Core>

namespace ipl_slam {
namespace {

// A line through `point` along the unit vector `direction`.
struct Axis {
  Eigen::Vector2d point, direction;

  [[nodiscard]] double along(const Eigen::Vector2d& p) const { return direction.dot(p - point); }
  [[nodiscard]] double offset(const Eigen::Vector2d& p) const {
    const Eigen::Vector2d d = p - point;
    return std::abs(direction.x() * d.y() - direction.y() * d.x());
  }
};

// Pieces of one edge, as mass spread evenly along each of them. A piece's mass is its length over the
// variance of its position, 4^octave.
class Edge {
 public:
  explicit Edge(const LineSegment& s)
      : start_(s.start.cast<double>()),
        end_(s.end.cast<double>()),
        octave_(s.octave),
        contrast_times_length_(s.contrast * (end_ - start_).norm()),
        length_sum_((end_ - start_).norm()) {
    mass_ = std::ldexp(length_sum_, -2 * s.octave);
    const Eigen::Vector2d middle = 0.5 * (start_ + end_), half = 0.5 * (end_ - start_);
    first_ = mass_ * middle;
    second_ = mass_ * (middle * middle.transpose() + half * half.transpose() / 3.0);
    points_ = {{start_, s.octave}, {end_, s.octave}};
  }

  [[nodiscard]] Eigen::Vector2d start() const { return start_; }
  [[nodiscard]] Eigen::Vector2d end() const { return end_; }
  [[nodiscard]] double length() const { return (end_ - start_).norm(); }
  [[nodiscard]] Eigen::Vector2d direction() const { return (end_ - start_).normalized(); }

  // The two as one, whether or not they belong together.
  [[nodiscard]] Edge with(const Edge& other) const {
    Edge sum = *this;
    sum.mass_ += other.mass_;
    sum.first_ += other.first_;
    sum.second_ += other.second_;
    sum.octave_ = std::min(octave_, other.octave_);
    sum.contrast_times_length_ += other.contrast_times_length_;
    sum.length_sum_ += other.length_sum_;
    sum.points_.insert(sum.points_.end(), other.points_.begin(), other.points_.end());
    sum.fit(direction());
    return sum;
  }

  // Largest distance of a piece's end point from the edge, in pixels of the octave it was found on.
  [[nodiscard]] double spread() const {
    const Axis axis{start_, direction()};
    double largest = 0.0;
    for (const auto& [point, octave] : points_) {
      largest = std::max(largest, std::ldexp(axis.offset(point), -octave));
    }
    return largest;
  }

  [[nodiscard]] LineSegment segment() const {
    LineSegment s;
    s.start = start_.cast<float>();
    s.end = end_.cast<float>();
    s.contrast = static_cast<float>(contrast_times_length_ / length_sum_);
    s.octave = octave_;
    return s;
  }

 private:
  // The principal axis of the mass, cut to what the pieces span.
  void fit(const Eigen::Vector2d& rough_direction) {
    const Eigen::Vector2d mean = first_ / mass_;
    const Eigen::Matrix2d c = second_ / mass_ - mean * mean.transpose();
    const double angle = 0.5 * std::atan2(2.0 * c(0, 1), c(0, 0) - c(1, 1));
    Axis axis{mean, {std::cos(angle), std::sin(angle)}};
    if (axis.direction.dot(rough_direction) < 0.0) axis.direction = -axis.direction;
    double low = INFINITY, high = -INFINITY;
    for (const auto& [point, octave] : points_) {
      low = std::min(low, axis.along(point));
      high = std::max(high, axis.along(point));
    }
    start_ = axis.point + low * axis.direction;
    end_ = axis.point + high * axis.direction;
  }

  Eigen::Vector2d start_, end_;
  int octave_;
  double contrast_times_length_, length_sum_;
  double mass_ = 0.0;
  Eigen::Vector2d first_;
  Eigen::Matrix2d second_;
  std::vector<std::pair<Eigen::Vector2d, int>> points_;  // end points of the pieces and their octaves
};

// Space between the two along `a`; negative where they overlap.
double gap_between(const Edge& a, const Edge& b) {
  const Axis axis{a.start(), a.direction()};
  return std::max(axis.along(b.start()) - a.length(), -axis.along(b.end()));
}

// The two as one, where they are pieces of one edge.
std::optional<Edge> joined(const Edge& a, const Edge& b, const SegmentJoinerOptions& options) {
  const double max_angle = options.max_angle * std::numbers::pi / 180.0;
  if (a.direction().dot(b.direction()) < std::cos(max_angle)) return std::nullopt;
  const double gap = gap_between(a, b);
  if (gap > std::min(options.max_gap, options.max_gap_ratio * std::min(a.length(), b.length()))) {
    return std::nullopt;
  }
  Edge both = a.with(b);
  if (both.spread() > options.max_offset) return std::nullopt;
  return both;
}

bool comes_first(const Edge& a, const Edge& b) {
  return a.length() > b.length();
}

}  // namespace

std::vector<LineSegment> join_segments(std::vector<LineSegment> segments,
                                       const SegmentJoinerOptions& options) {
  std::vector<Edge> open;
  for (const LineSegment& s : segments) open.emplace_back(s);
  std::stable_sort(open.begin(), open.end(), comes_first);
  std::vector<Edge> done;
  std::vector<bool> used(open.size(), false);
  for (std::size_t i = 0; i < open.size(); ++i) {
    if (used[i]) continue;
    Edge edge = open[i];
    for (std::size_t j = i + 1; j < open.size(); ++j) {
      if (used[j]) continue;
      if (std::optional<Edge> both = joined(edge, open[j], options)) {
        edge = *std::move(both);
        used[j] = true;
        j = i;  // what was too far away may be in reach now
      }
    }
    done.push_back(std::move(edge));
  }
  std::stable_sort(done.begin(), done.end(), comes_first);
  std::vector<LineSegment> result;
  for (const Edge& edge : done) result.push_back(edge.segment());
  return result;
}

}  // namespace ipl_slam
