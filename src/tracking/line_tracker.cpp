#include "tracking/line_tracker.hpp"

#include <algorithm>
#include <cmath>

namespace ipl_slam {

LineTracker::LineTracker(const Camera& camera, const LineTrackerOptions& options,
                         const DepthNoiseOptions& noise, const SegmentDepthOptions& depth_options,
                         std::uint64_t seed)
    : camera_(camera),
      options_(options),
      noise_(noise),
      depth_options_(depth_options),
      seed_(seed),
      visibility_(camera),
      search_(camera, options.search) {}

LineSights LineTracker::look(const cv::Mat& grey, const SE3& T_cw, const LocalMap& map, double radius) const {
  struct Candidate {
    double length;
    int line;
    ExpectedLine expected;
  };
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < map.lines.size() && !grey.empty(); ++i) {
    const LocalLine& line = map.lines[i];
    const auto part = visibility_.visible_part(T_cw, line.start, line.end);
    if (!part) continue;
    const double length = (part->second - part->first).norm();
    if (length < options_.min_length) continue;
    candidates.push_back({length, static_cast<int>(i), {part->first, part->second, line.contrast}});
  }
  const auto count = std::min(candidates.size(), static_cast<std::size_t>(options_.max_lines));
  std::partial_sort(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(count),
                    candidates.end(), [](const Candidate& a, const Candidate& b) {
                      return a.length != b.length ? a.length > b.length : a.line < b.line;
                    });
  candidates.resize(count);

  LineSights sights;
  for (const Candidate& candidate : candidates) {
    sights.visible.push_back(candidate.line);
    if (const auto found = search_.find(grey, candidate.expected, radius)) {
      sights.found.push_back({candidate.line, *found});
    }
  }
  return sights;
}

void LineTracker::measure_depth(const cv::Mat& depth, LineSights& sights) const {
  for (LineSight& sight : sights.found) {
    LineSegment segment;
    segment.start = sight.at.start.cast<float>();
    segment.end = sight.at.end.cast<float>();
    segment.start_pixel = camera_.distort(sight.at.start).cast<float>();
    segment.end_pixel = camera_.distort(sight.at.end).cast<float>();
    sight.depth = segment_depth(depth, segment, camera_, noise_, depth_options_, seed_);
  }
}

std::vector<LineMatch> LineTracker::matches(const LineSights& sights, const LocalMap& map) const {
  std::vector<LineMatch> matches;
  for (const LineSight& sight : sights.found) {
    LineMatch match;
    match.line_w = map.lines[static_cast<std::size_t>(sight.line)].line;
    match.start = sight.at.start;
    match.end = sight.at.end;
    match.sigma2 = sight.at.sigma2;
    match.weight = map.lines[static_cast<std::size_t>(sight.line)].weight;
    if (sight.depth.known()) {
      match.inverse_start = sight.depth.inverse_start;
      match.inverse_end = sight.depth.inverse_end;
      match.sigma_start = std::hypot(options_.depth_sigma, std::sqrt(sight.depth.covariance(0, 0)));
      match.sigma_end = std::hypot(options_.depth_sigma, std::sqrt(sight.depth.covariance(1, 1)));
    }
    matches.push_back(match);
  }
  return matches;
}

}  // namespace ipl_slam
