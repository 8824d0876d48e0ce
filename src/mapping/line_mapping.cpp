#include "mapping/line_mapping.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ipl_slam {
namespace {

// Pieces of one edge point the same way within 11 degrees even where one is short and its depth is poor ...
constexpr double kSameDirection = 0.98;
// ... and touch, but for what covers a tenth of the edge.
constexpr double kMaxGap = 0.1;

// Lines that the keyframes around `id` see.
std::set<LineId> lines_around(const Map& map, KeyframeId id) {
  std::set<LineId> lines;
  for (const Covisible& neighbour : map.covisible(id)) {
    for (const LineId line : map.keyframes()[neighbour.keyframe].lines) {
      if (line.valid()) lines.insert(line);
    }
  }
  return lines;
}

// Length of the gap between two pieces of (nearly) one line; negative where they overlap, m.
double gap(const Line& a, const Line& b) {
  const Eigen::Vector3d& along = a.line.direction;
  const double a0 = along.dot(a.start), a1 = along.dot(a.end), b0 = along.dot(b.start), b1 = along.dot(b.end);
  return std::max(std::min(b0, b1) - std::max(a0, a1), std::min(a0, a1) - std::max(b0, b1));
}

}  // namespace

void LineMapping::associate(Map& map, KeyframeId id, const std::vector<SeenLine>& tracked) const {
  std::set<LineId> candidates = lines_around(map, id);
  for (const SeenLine& seen : tracked) {
    const LineId line = map.resolve(seen.line);
    if (line.valid()) candidates.insert(line);
  }
  observe(map, id, candidates);
}

// Finds lines among the segments of a keyframe.
void LineMapping::observe(Map& map, KeyframeId id, const std::set<LineId>& candidates) const {
  const SE3 T_cw = map.keyframes()[id].T_cw;
  const LineFeatures& features = *map.keyframes()[id].line_features;
  std::vector<ProjectedSegment> projected;
  std::vector<LineId> lines;
  for (const LineId line_id : candidates) {
    const Line& line = map.lines()[line_id];
    const auto part = visibility_.visible_part(T_cw, line.start, line.end);
    if (!part) continue;
    projected.push_back({part->first.cast<float>(), part->second.cast<float>(), &line.descriptor,
                         static_cast<float>(options_.radius)});
    lines.push_back(line_id);
  }
  const std::vector<int> found = match_projected_lines(features, projected, options_.match);
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i] < 0) continue;
    const auto segment = static_cast<std::uint32_t>(found[i]);
    if (!agrees(T_cw * map.lines()[lines[i]].line, features.segments[segment])) continue;
    map.add_observation(lines[i], id, segment);
    map.refresh(lines[i]);
  }
}

std::vector<LineId> LineMapping::create(Map& map, KeyframeId id) const {
  std::vector<LineId> created;
  const std::shared_ptr<const LineFeatures> features = map.keyframes()[id].line_features;
  const SE3 T_wc = map.keyframes()[id].T_cw.inverse();
  for (std::uint32_t s = 0; s < features->size(); ++s) {
    const LineSegment& segment = features->segments[s];
    if (map.keyframes()[id].lines[s].valid() || !segment.depth.known()) continue;
    if (map.keyframes()[id].line_trust.weight(s) <= 0.0) continue;
    const auto in_space = [&](const Eigen::Vector2f& uv, float inverse_depth) {
      return Eigen::Vector3d(T_wc * camera_.unproject(uv.cast<double>(), 1.0 / inverse_depth));
    };
    const Eigen::Vector3d start = in_space(segment.start, segment.depth.inverse_start);
    const Eigen::Vector3d end = in_space(segment.end, segment.depth.inverse_end);
    const auto line = Line3::through(start, end);
    if (line && project_line(camera_, map.keyframes()[id].T_cw * *line)) {
      created.push_back(map.add_line(*line, start, end, id, s));
    }
  }
  return created;
}

void LineMapping::fuse(Map& map, KeyframeId id) const {
  join_same_edges(map, id, lines_around(map, id));
}

void LineMapping::fuse_into(Map& map, KeyframeId target, std::span<const LineId> candidates) const {
  const std::set<LineId> lines(candidates.begin(), candidates.end());
  observe(map, target, lines);
  join_same_edges(map, target, lines);
}

void LineMapping::join(Map& map, LineId kept, LineId gone) const {
  map.fuse(kept, gone);
  const Line& both = map.lines()[kept];
  if (const auto extent = observed_extent(map, camera_, noise_, both.line, both.observations))
    map.set_line(kept, both.line, extent->first, extent->second);
}

// Joins lines of the keyframe with those of `others` that are the same edge.
void LineMapping::join_same_edges(Map& map, KeyframeId id, const std::set<LineId>& others) const {
  const std::vector<LineId> own = map.keyframes()[id].lines;
  for (const LineId slot : own) {
    LineId line = map.resolve(slot);
    if (!line.valid()) continue;
    for (const LineId other_id : others) {
      const LineId other = map.resolve(other_id);
      if (!other.valid() || other == line || !same_edge(map, line, other)) continue;
      const bool keep_other = map.lines()[other].observations.size() > map.lines()[line].observations.size();
      const LineId kept = keep_other ? other : line;
      join(map, kept, keep_other ? line : other);
      line = kept;
    }
  }
}

// Whether the depth measured along the segment is that of the line.
bool LineMapping::agrees(const Line3& line_c, const LineSegment& segment) const {
  const double gate = options_.inverse_depth_gate;
  if (!segment.depth.known() || gate <= 0.0) return true;
  const auto differs = [&](const Eigen::Vector2f& uv, float measured) {
    return std::abs(inverse_depth_at(camera_, line_c, uv.cast<double>()) - measured) > gate;
  };
  return !differs(segment.start, segment.depth.inverse_start) &&
         !differs(segment.end, segment.depth.inverse_end);
}

// Two lines are the same edge when they coincide in every keyframe that sees either, at the same depth, and
// touch or nearly do. Two that one keyframe shows apart are not.
bool LineMapping::same_edge(const Map& map, LineId a, LineId b) const {
  const Line &first = map.lines()[a], &second = map.lines()[b];
  if (first.line.direction.dot(second.line.direction) < kSameDirection) return false;
  const double longer = std::max((first.end - first.start).norm(), (second.end - second.start).norm());
  if (gap(first, second) > kMaxGap * longer) return false;
  int views = 0;
  for (const auto& [seen, other] : {std::pair(a, b), std::pair(b, a)}) {
    for (const Observation& o : map.lines()[seen].observations) {
      const Keyframe& keyframe = map.keyframes()[o.keyframe];
      if (map.observes(o.keyframe, other)) return false;
      const auto distance = image_distance(keyframe.T_cw, map.lines()[seen], map.lines()[other]);
      if (!distance) continue;
      if (*distance > options_.fusion_radius) return false;
      if (!agrees(keyframe.T_cw * map.lines()[other].line, keyframe.line_features->segments[o.feature]))
        return false;
      ++views;
    }
  }
  return views > 0;
}

// How far the ends of the other's visible part lie from the line in the image, pixels; nothing where it does
// not show, or the line is seen end-on.
std::optional<double> LineMapping::image_distance(const SE3& T_cw, const Line& line,
                                                  const Line& other) const {
  const auto image = project_line(camera_, T_cw * line.line);
  const auto part = visibility_.visible_part(T_cw, other.start, other.end);
  if (!image || !part) return std::nullopt;
  return std::max(std::abs(signed_distance(*image, part->first)),
                  std::abs(signed_distance(*image, part->second)));
}

std::optional<std::pair<Eigen::Vector3d, Eigen::Vector3d>> observed_extent(
    const Map& map, const Camera& camera, const DepthNoiseOptions& noise, const Line3& line_w,
    const std::vector<Observation>& observations) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Observation& o : observations) {
    const Keyframe& keyframe = map.keyframes()[o.keyframe];
    const LineSegment& segment = keyframe.line_features->segments[o.feature];
    const Line3 line_c = keyframe.T_cw * line_w;
    const SE3 T_wc = keyframe.T_cw.inverse();
    for (const Eigen::Vector2f& end : {segment.start, segment.end}) {
      const Eigen::Vector2d uv = end.cast<double>();
      const double inverse_depth = inverse_depth_at(camera, line_c, uv);
      if (!(inverse_depth * noise.max_depth > 1.0)) continue;  // too far off to believe, or behind
      const double along = line_w.direction.dot(T_wc * camera.unproject(uv, 1.0 / inverse_depth));
      low = std::min(low, along);
      high = std::max(high, along);
    }
  }
  if (!(low < high)) return std::nullopt;
  const Eigen::Vector3d foot = line_w.nearest_to_origin();
  return std::pair<Eigen::Vector3d, Eigen::Vector3d>(foot + low * line_w.direction,
                                                     foot + high * line_w.direction);
}

}  // namespace ipl_slam
