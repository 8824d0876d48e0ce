#include "pipeline/keyframe_lines.hpp"

#include <algorithm>

#include "common/stopwatch.hpp"

namespace ipl_slam {
namespace {

// A segment belongs to a region that holds half of it.
constexpr double kBelongs = 0.5;

InstanceId region_of(const LineSegment& segment, const std::vector<Region>& regions) {
  const Eigen::Vector2d start = segment.start_pixel.cast<double>(), end = segment.end_pixel.cast<double>();
  for (const Region& region : regions) {
    if (share_inside(region.mask, start, end) >= kBelongs) return region.id;
  }
  return {};
}

}  // namespace

std::vector<RegionLines> KeyframeLines::process(NewKeyframe& keyframe) {
  const Stopwatch stopwatch;
  KeyframeCandidate& candidate = keyframe.candidate;
  if (!candidate.lines) {
    candidate.lines = std::make_shared<const LineFeatures>(extractor_.extract(keyframe.grey, keyframe.depth));
  }
  const FeatureWeights& weights = candidate.tracked.weights;
  const LineMotion motion = motion_of(candidate);
  candidate.line_trust.weights = motion.weight;
  candidate.line_trust.regions.assign(candidate.lines->size(), InstanceId{});
  std::vector<RegionLines> told;
  if (weights.regions) {
    for (const Region& region : *weights.regions) told.push_back({region.id});
    for (std::size_t s = 0; s < candidate.lines->size(); ++s) {
      const LineSegment& segment = candidate.lines->segments[s];
      const InstanceId id = region_of(segment, *weights.regions);
      candidate.line_trust.regions[s] = id;
      if (weights.dynamic_share(segment.start_pixel.cast<double>(), segment.end_pixel.cast<double>()) >
          max_dynamic_share_) {
        candidate.line_trust.weights[s] = 0.0;
      }
      const auto region =
          std::find_if(told.begin(), told.end(), [&](const RegionLines& r) { return r.region == id; });
      if (region == told.end() || !motion.matched[s]) continue;
      ++region->lines;
      region->moved += motion.dynamic[s];
    }
  }
  before_ = candidate.lines;
  T_before_w_ = candidate.tracked.T_cw;
  keyframe.line_milliseconds += stopwatch.milliseconds();
  return told;
}

LineMotion KeyframeLines::motion_of(const KeyframeCandidate& candidate) const {
  if (before_)
    return check_.compare(*before_, *candidate.lines, candidate.tracked.T_cw * T_before_w_.inverse());
  const std::size_t n = candidate.lines->size();
  return {std::vector<std::uint8_t>(n, 0), std::vector<std::uint8_t>(n, 0), std::vector<double>(n, 1.0)};
}

}  // namespace ipl_slam
