#include "features/line_matcher.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <tuple>

#include "features/line_motion.hpp"
#include "features/segment_gate.hpp"
#include "geometry/line3.hpp"

namespace ipl_slam {
namespace {

constexpr int kNoDistance = std::numeric_limits<int>::max();

// Segments whose end points lie this near to each other's lines are pieces of one edge, pixels.
constexpr double kSameLine = 4.0;

struct Candidate {
  int from = -1, to = -1;
  int distance = kNoDistance;  // bits

  // By distance, then index, so that the order of visits does not matter.
  [[nodiscard]] auto rank() const { return std::tuple(distance, from, to); }
};

bool same_line(const LineSegment& a, const LineSegment& b) {
  const auto near = [](const LineSegment& of, const LineSegment& to) {
    const auto line = image_line(to.start.cast<double>(), to.end.cast<double>());
    return line && std::abs(signed_distance(*line, of.start.cast<double>())) < kSameLine &&
           std::abs(signed_distance(*line, of.end.cast<double>())) < kSameLine;
  };
  return near(a, b) || near(b, a);
}

/// Marks, of the candidates of one segment, those that may win: the closest, and pieces of the same line,
/// unless another line comes too near to it. `other` gives the segment at the other side of a candidate.
template <class Other>
bool unambiguous(std::span<const Candidate> rivals, const Candidate& best, double ratio, Other&& other) {
  if (ratio >= 1.0) return true;
  return std::none_of(rivals.begin(), rivals.end(), [&](const Candidate& c) {
    return best.distance >= ratio * c.distance && !same_line(other(c), other(best));
  });
}

/// The closest candidate of each segment of one side that no other line comes near to, indexed by `key`;
/// candidates come in groups of equal key.
template <class Key, class Other>
std::vector<Candidate> winners(std::span<const Candidate> candidates, std::size_t count, double ratio,
                               Key&& key, Other&& other) {
  std::vector<Candidate> best(count);
  for (std::size_t begin = 0, end = 0; begin < candidates.size(); begin = end) {
    while (end < candidates.size() && key(candidates[end]) == key(candidates[begin])) ++end;
    const auto group = candidates.subspan(begin, end - begin);
    const Candidate& closest = *std::min_element(
        group.begin(), group.end(), [](const auto& x, const auto& y) { return x.rank() < y.rank(); });
    if (unambiguous(group, closest, ratio, other)) best[static_cast<std::size_t>(key(closest))] = closest;
  }
  return best;
}

/// Candidates for all segments of `a`, moved, in order of a, then b.
std::vector<Candidate> find_candidates(const LineFeatures& a, const LineFeatures& b,
                                       const SegmentTable& table, const ImageMotion& motion,
                                       const SegmentGate& gate, Simd simd) {
  std::vector<Candidate> candidates;
  std::vector<int> found;
  for (std::size_t i = 0; i < a.size(); ++i) {
    found.clear();
    table.find(motion * a.segments[i].start, motion * a.segments[i].end, gate, simd, found);
    for (const int j : found) {
      const int distance = hamming_distance(a.descriptors[i], b.descriptors[static_cast<std::size_t>(j)]);
      candidates.push_back({static_cast<int>(i), j, distance});
    }
  }
  return candidates;
}

/// Pairs that choose each other.
std::vector<std::pair<int, int>> mutual_best(const LineFeatures& a, const LineFeatures& b,
                                             std::vector<Candidate> candidates,
                                             const LineMatchOptions& options) {
  const auto segment_a = [&](const Candidate& c) -> const LineSegment& {
    return a.segments[static_cast<std::size_t>(c.from)];
  };
  const auto segment_b = [&](const Candidate& c) -> const LineSegment& {
    return b.segments[static_cast<std::size_t>(c.to)];
  };
  const auto from = [](const Candidate& c) { return c.from; };
  const auto to = [](const Candidate& c) { return c.to; };
  const auto forth = winners(candidates, a.size(), options.ratio, from, segment_b);
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& x, const Candidate& y) { return x.to < y.to; });
  const auto back = winners(candidates, b.size(), options.ratio, to, segment_a);
  std::vector<std::pair<int, int>> pairs;
  for (const Candidate& c : forth) {
    if (c.from < 0 || c.distance > options.max_distance) continue;
    if (back[static_cast<std::size_t>(c.to)].from == c.from) pairs.emplace_back(c.from, c.to);
  }
  return pairs;
}

void check_sizes(const LineFeatures& lines) {
  if (lines.segments.size() != lines.descriptors.size()) {
    throw std::invalid_argument("line matching: one descriptor per segment is needed");
  }
}

}  // namespace

std::vector<std::pair<int, int>> match_lines(const LineFeatures& a, const LineFeatures& b,
                                             const LineMatchOptions& options, Simd simd) {
  check_sizes(a), check_sizes(b);
  SegmentGate gate;
  gate.min_overlap = static_cast<float>(options.min_overlap);
  gate.max_length_ratio = static_cast<float>(options.max_length_ratio);
  const SegmentTable table(b.segments);

  gate.radius = gate.along = static_cast<float>(options.max_displacement);
  gate.min_cosine = static_cast<float>(std::cos(options.max_rotation));
  const auto seeds = mutual_best(a, b, find_candidates(a, b, table, {}, gate, simd), options);
  const ImageMotion motion = common_motion(a.segments, b.segments, seeds, options.max_offset);

  gate.radius = gate.along = static_cast<float>(options.max_offset);
  gate.min_cosine = static_cast<float>(std::cos(options.max_turn));
  return mutual_best(a, b, find_candidates(a, b, table, motion, gate, simd), options);
}

std::vector<int> match_projected_lines(const LineFeatures& lines, std::span<const ProjectedSegment> projected,
                                       const LineProjectionOptions& options, Simd simd) {
  check_sizes(lines);
  SegmentGate gate;
  gate.min_cosine = static_cast<float>(std::cos(options.max_angle));
  gate.min_overlap = static_cast<float>(options.min_overlap);
  gate.max_length_ratio = static_cast<float>(options.max_length_ratio);
  const SegmentTable table(lines.segments);
  const auto segment = [&](const Candidate& c) -> const LineSegment& {
    return lines.segments[static_cast<std::size_t>(c.to)];
  };

  std::vector<Candidate> good, own;
  std::vector<int> found;
  for (std::size_t i = 0; i < projected.size(); ++i) {
    const ProjectedSegment& p = projected[i];
    gate.radius = p.radius;
    found.clear(), own.clear();
    table.find(p.start, p.end, gate, simd, found);
    for (const int j : found) {
      own.push_back({static_cast<int>(i), j,
                     hamming_distance(*p.descriptor, lines.descriptors[static_cast<std::size_t>(j)])});
    }
    for (const Candidate& c : own) {
      if (c.distance <= options.max_distance && unambiguous(own, c, options.ratio, segment))
        good.push_back(c);
    }
  }
  std::sort(good.begin(), good.end(), [](const auto& x, const auto& y) { return x.rank() < y.rank(); });
  std::vector<int> matches(projected.size(), -1);
  std::vector<char> taken(lines.size());
  for (const Candidate& c : good) {
    int& match = matches[static_cast<std::size_t>(c.from)];
    if (match >= 0 || taken[static_cast<std::size_t>(c.to)] != 0) continue;
    match = c.to;
    taken[static_cast<std::size_t>(c.to)] = 1;
  }
  return matches;
}

}  // namespace ipl_slam
