#include "loop/guided_search.hpp"

#include <cmath>

namespace ipl_slam {

GuidedSearch::GuidedSearch(const Camera& camera, const ScalePyramid& pyramid, const DepthNoiseOptions& noise,
                           const GuidedSearchOptions& options, const PoseOptimizerOptions& pose)
    : pyramid_(pyramid),
      options_(options),
      optimizer_(camera, noise, pose),
      visibility_(camera, pyramid),
      line_visibility_(camera) {}

Placement GuidedSearch::place(const Map& map, const PlaceView& view, const LandmarkGroup& group,
                              const SE3& T_cw, double radius) const {
  Placement placement;
  placement.points = find_points(map, view, group, T_cw, radius);
  placement.lines = find_lines(map, view, group, T_cw, radius);

  std::vector<PointMatch> points;
  std::vector<PointId*> point_slots;
  for (std::size_t k = 0; k < placement.points.size(); ++k) {
    PointId& id = placement.points[k];
    if (!id.valid()) continue;
    points.push_back(point_match(map.points()[id].position, view.frame.features.keypoints[k], pyramid_,
                                 view.trust.weight(k)));
    point_slots.push_back(&id);
  }
  std::vector<LineMatch> lines;
  std::vector<LineId*> line_slots;
  for (std::size_t s = 0; s < placement.lines.size(); ++s) {
    LineId& id = placement.lines[s];
    if (!id.valid()) continue;
    lines.push_back(line_match(map.lines()[id].line, view.lines->segments[s], view.line_trust.weight(s)));
    line_slots.push_back(&id);
  }

  const PoseEstimate estimate = optimizer_.optimize(T_cw, points, lines);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!estimate.inlier[i]) *point_slots[i] = PointId{};
  }
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (!estimate.line_inlier[i]) *line_slots[i] = LineId{};
  }
  placement.T_cw = estimate.T_cw;
  placement.inliers = estimate.inliers;
  placement.line_inliers = estimate.line_inliers;
  placement.deviation = largest_deviation(estimate.information);
  return placement;
}

std::vector<PointId> GuidedSearch::find_points(const Map& map, const PlaceView& view,
                                               const LandmarkGroup& group, const SE3& T_cw,
                                               double radius) const {
  std::vector<ProjectedPoint> windows;
  std::vector<PointId> owners;
  for (const PointId id : group.points) {
    if (const auto window = visibility_.project(T_cw, map.points()[id], radius)) {
      windows.push_back(*window);
      owners.push_back(id);
    }
  }
  const std::vector<int> found =
      match_projected(view.frame.features, view.frame.grid, windows, options_.match,
                      removed_features(view.trust.weights, view.frame.features.size()));
  std::vector<PointId> points(view.frame.features.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i] >= 0) points[static_cast<std::size_t>(found[i])] = owners[i];
  }
  return points;
}

std::vector<LineId> GuidedSearch::find_lines(const Map& map, const PlaceView& view,
                                             const LandmarkGroup& group, const SE3& T_cw,
                                             double radius) const {
  if (!view.lines) return {};
  std::vector<ProjectedSegment> windows;
  std::vector<LineId> owners;
  for (const LineId id : group.lines) {
    const Line& line = map.lines()[id];
    const auto part = line_visibility_.visible_part(T_cw, line.start, line.end);
    if (!part) continue;
    windows.push_back({part->first.cast<float>(), part->second.cast<float>(), &line.descriptor,
                       static_cast<float>(radius)});
    owners.push_back(id);
  }
  const std::vector<int> found = match_projected_lines(*view.lines, windows, options_.line_match);
  std::vector<LineId> lines(view.lines->size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i] < 0) continue;
    const auto segment = static_cast<std::size_t>(found[i]);
    if (view.line_trust.weight(segment) > 0.0) lines[segment] = owners[i];
  }
  return lines;
}

LineMatch GuidedSearch::line_match(const Line3& line_w, const LineSegment& segment, double weight) const {
  const double sigma = options_.line_sigma * std::exp2(segment.octave);
  LineMatch match{.line_w = line_w,
                  .start = segment.start.cast<double>(),
                  .end = segment.end.cast<double>(),
                  .sigma2 = sigma * sigma,
                  .weight = weight};
  if (segment.depth.known()) {
    match.inverse_start = segment.depth.inverse_start;
    match.inverse_end = segment.depth.inverse_end;
    match.sigma_start = std::hypot(options_.line_depth_sigma, std::sqrt(segment.depth.covariance(0, 0)));
    match.sigma_end = std::hypot(options_.line_depth_sigma, std::sqrt(segment.depth.covariance(1, 1)));
  }
  return match;
}

}  // namespace ipl_slam
