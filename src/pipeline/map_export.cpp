#include "pipeline/map_export.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <map>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "map/landmark_part.hpp"
#include "pipeline/camera_json.hpp"

namespace ipl_slam {
namespace {

using Json = nlohmann::ordered_json;

Json vector_json(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

Json part_json(const Map& map, PartId part) {
  std::size_t keyframes = 0, points = 0, lines = 0;
  double first = std::numeric_limits<double>::infinity(), last = -first;
  Eigen::AlignedBox3d box;
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    if (keyframe.part != part) return;
    ++keyframes;
    first = std::min(first, keyframe.frame->timestamp), last = std::max(last, keyframe.frame->timestamp);
    box.extend(keyframe.T_cw.inverse().translation());
  });
  map.points().for_each([&](PointId, const Point& point) {
    if (part_of(map, point) != part) return;
    ++points;
    box.extend(point.position);
  });
  map.lines().for_each([&](LineId, const Line& line) {
    if (part_of(map, line) != part) return;
    ++lines;
    box.extend(line.start), box.extend(line.end);
  });
  return {{"part", part.value},
          {"keyframes", keyframes},
          {"points", points},
          {"lines", lines},
          {"first_time", first},
          {"last_time", last},
          {"low", vector_json(box.min())},
          {"high", vector_json(box.max())}};
}

}  // namespace

Json map_summary(const SavedMap& saved) {
  const Map& map = saved.map;
  Json parts = Json::array();
  for (const PartId part : map.parts()) parts.push_back(part_json(map, part));
  return {{"camera", camera_json(saved.camera)},
          {"pyramid", {{"levels", map.pyramid().levels()}, {"factor", map.pyramid().factor()}}},
          {"keyframes", map.keyframes().size()},
          {"points", map.points().size()},
          {"lines", map.lines().size()},
          {"loop_edges", map.loops().size()},
          {"parts", std::move(parts)}};
}

std::vector<TrajectoryPart> keyframe_parts(const Map& map, KeyframeId first) {
  TrajectoryParts parts;
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    if (id >= first) parts.add(keyframe.part, {keyframe.frame->timestamp, keyframe.T_cw.inverse()});
  });
  return parts.longest_first();
}

std::string points_ply(const Map& map) {
  std::string text = fmt::format(
      "ply\n"
      "format ascii 1.0\n"
      "comment point landmarks of ipl_slam, world frame, metres\n"
      "element vertex {}\n"
      "property double x\nproperty double y\nproperty double z\n"
      "property float nx\nproperty float ny\nproperty float nz\n"
      "property int id\nproperty int part\nproperty int observations\n"
      "end_header\n",
      map.points().size());
  map.points().for_each([&](PointId id, const Point& point) {
    const Eigen::Vector3d &p = point.position, &n = point.normal;
    fmt::format_to(std::back_inserter(text), "{:.6f} {:.6f} {:.6f} {:.4f} {:.4f} {:.4f} {} {} {}\n", p.x(),
                   p.y(), p.z(), n.x(), n.y(), n.z(), id.value, part_of(map, point).value,
                   point.observations.size());
  });
  return text;
}

Json map_graph(const Map& map) {
  const auto pose_json = [](const SE3& T) {
    const Eigen::Quaterniond& q = T.rotation();
    return Json{{"translation", vector_json(T.translation())},
                {"rotation_xyzw", {q.x(), q.y(), q.z(), q.w()}}};
  };
  Json keyframes = Json::array(), covisibility = Json::array(), loops = Json::array();
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    keyframes.push_back({{"id", id.value},
                         {"part", keyframe.part.value},
                         {"timestamp", keyframe.frame->timestamp},
                         {"T_wc", pose_json(keyframe.T_cw.inverse())}});
    std::vector<Covisible> neighbours = map.covisible(id);
    std::erase_if(neighbours, [&](const Covisible& c) { return c.keyframe < id; });  // each pair once
    std::sort(neighbours.begin(), neighbours.end(),
              [](const Covisible& a, const Covisible& b) { return a.keyframe < b.keyframe; });
    for (const Covisible& c : neighbours) {
      covisibility.push_back({{"a", id.value}, {"b", c.keyframe.value}, {"shared", c.shared}});
    }
  });
  for (const LoopEdge& edge : map.loops()) {
    loops.push_back({{"a", edge.a.value}, {"b", edge.b.value}, {"T_ab", pose_json(edge.T_ab)}});
  }
  return {{"keyframes", std::move(keyframes)},
          {"covisibility", std::move(covisibility)},
          {"loops", std::move(loops)}};
}

}  // namespace ipl_slam
