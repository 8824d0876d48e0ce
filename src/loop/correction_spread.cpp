#include "loop/correction_spread.hpp"

#include <algorithm>

namespace ipl_slam {
namespace {

KeyframeId leader(const std::vector<Observation>& observations, const KeyframePoses& held) {
  const auto known = std::find_if(observations.begin(), observations.end(),
                                  [&](const Observation& o) { return held.contains(o.keyframe); });
  return known != observations.end() ? known->keyframe : observations.front().keyframe;
}

bool same(const SE3& a, const SE3& b) {
  return a.translation() == b.translation() && a.rotation().coeffs() == b.rotation().coeffs();
}

}  // namespace

std::optional<KeyframePoses> spread_correction(const Map& map, const std::vector<EssentialEdge>& edges,
                                               const KeyframePoses& held, const PoseGraphOptions& options,
                                               const std::atomic<bool>* abort) {
  std::map<KeyframeId, std::uint32_t> index;
  for (const EssentialEdge& edge : edges) {
    for (const KeyframeId id : {edge.a, edge.b}) index.emplace(id, 0);
  }
  PoseGraph graph;
  for (auto& [id, i] : index) {
    i = static_cast<std::uint32_t>(graph.poses.size());
    const auto known = held.find(id);
    const bool fixed = known != held.end();
    graph.poses.push_back({fixed ? known->second : map.keyframes()[id].T_cw, fixed});
  }
  for (const EssentialEdge& edge : edges) {
    if (held.contains(edge.a) && held.contains(edge.b)) continue;
    graph.edges.push_back({index[edge.a], index[edge.b], edge.T_ab});
  }
  if (optimize_pose_graph(graph, options, abort).aborted) return std::nullopt;
  KeyframePoses poses = held;
  for (const auto& [id, i] : index) poses.emplace(id, graph.poses[i].T_cw);
  return poses;
}

void move_keyframes(Map& map, const KeyframePoses& poses, const KeyframePoses& held) {
  KeyframePoses moves;  // of the world around a keyframe: where it was -> where it is
  for (const auto& [id, T_cw] : poses) {
    if (same(T_cw, map.keyframes()[id].T_cw)) continue;
    moves.emplace(id, T_cw.inverse() * map.keyframes()[id].T_cw);
    map.set_pose(id, T_cw);
  }
  const auto move_of = [&](const auto& landmark) -> const SE3* {
    const auto move = moves.find(leader(landmark.observations, held));
    return move != moves.end() ? &move->second : nullptr;
  };
  map.points().for_each([&](PointId id, const Point& point) {
    if (const SE3* move = move_of(point)) map.set_position(id, *move * point.position);
    const bool seen_anew = std::any_of(point.observations.begin(), point.observations.end(),
                                       [&](const Observation& o) { return moves.contains(o.keyframe); });
    if (seen_anew) map.refresh(id);
  });
  map.lines().for_each([&](LineId id, const Line& line) {
    if (const SE3* move = move_of(line))
      map.set_line(id, *move * line.line, *move * line.start, *move * line.end);
  });
}

}  // namespace ipl_slam
