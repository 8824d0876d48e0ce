#include "map/local_map.hpp"

#include <algorithm>
#include <cmath>
#include <set>

namespace ipl_slam {
namespace {

// Two cameras look the same way when their optical axes are less than 45 degrees apart.
const double kSameView = std::cos(M_PI / 4.0);

std::set<KeyframeId> choose_keyframes(const Map& map, KeyframeId centre, const LocalMapOptions& options) {
  const auto limit = static_cast<std::size_t>(options.max_keyframes);
  std::set<KeyframeId> chosen{centre};
  const auto add = [&](KeyframeId id) {
    if (chosen.size() < limit) chosen.insert(id);
  };

  const std::vector<Covisible> neighbours = map.covisible(centre);
  for (const Covisible& n : neighbours) add(n.keyframe);
  for (std::size_t i = 0; i < neighbours.size() && i < static_cast<std::size_t>(options.neighbours); ++i) {
    if (chosen.size() >= limit) break;
    const std::vector<Covisible> second = map.covisible(neighbours[i].keyframe);
    for (std::size_t j = 0; j < second.size() && j < static_cast<std::size_t>(options.neighbours); ++j) {
      add(second[j].keyframe);
    }
  }

  // Drift may have kept a revisited place from being matched; its keyframes are still close.
  const SE3 T_wc = map.keyframes()[centre].T_cw.inverse();
  const Eigen::Vector3d axis = T_wc.rotation() * Eigen::Vector3d::UnitZ();
  std::vector<std::pair<double, KeyframeId>> nearby;
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    if (keyframe.part != map.keyframes()[centre].part) return;
    const SE3 other = keyframe.T_cw.inverse();
    const double distance = (other.translation() - T_wc.translation()).norm();
    const double cosine = axis.dot(other.rotation() * Eigen::Vector3d::UnitZ());
    if (distance < options.nearby_distance && cosine > kSameView) nearby.emplace_back(distance, id);
  });
  std::sort(nearby.begin(), nearby.end());
  for (const auto& [distance, id] : nearby) add(id);
  return chosen;
}

// alpha_l of the newest sight.
double weight_of(const Map& map, const Line& line) {
  const Observation& newest = line.observations.back();
  return map.keyframes()[newest.keyframe].line_trust.weight(newest.feature);
}

}  // namespace

const LocalKeyframe* LocalMap::find_keyframe(KeyframeId id) const {
  const auto at = std::lower_bound(keyframes.begin(), keyframes.end(), id,
                                   [](const LocalKeyframe& k, KeyframeId i) { return k.id < i; });
  return at != keyframes.end() && at->id == id ? &*at : nullptr;
}

int LocalMap::find_point(PointId id) const {
  const auto at = std::lower_bound(points.begin(), points.end(), id,
                                   [](const LocalPoint& p, PointId i) { return p.id < i; });
  return at != points.end() && at->id == id ? static_cast<int>(at - points.begin()) : -1;
}

LocalMap build_local_map(const Map& map, KeyframeId centre, const LocalMapOptions& options) {
  LocalMap local;
  local.centre = centre;
  local.part = map.keyframes()[centre].part;
  for (const KeyframeId id : choose_keyframes(map, centre, options)) {
    const Keyframe& keyframe = map.keyframes()[id];
    local.keyframes.push_back({id, keyframe.T_cw, keyframe.frame, {}, {}});
  }

  // Takes over the landmarks of one kind that these keyframes see; `add` copies one to the end of its list.
  const auto collect = [&](auto seen_by, auto indices_of, std::size_t ids_used, auto add) {
    std::vector<std::uint8_t> wanted(ids_used, 0);
    for (const LocalKeyframe& keyframe : local.keyframes) {
      for (const auto landmark : map.keyframes()[keyframe.id].*seen_by) {
        if (landmark.valid()) wanted[landmark.value] = 1;
      }
    }
    std::vector<std::uint32_t> index(ids_used, 0);
    std::uint32_t count = 0;
    for (std::uint32_t i = 0; i < ids_used; ++i) {
      if (!wanted[i]) continue;
      index[i] = count++;
      add(i);
    }
    for (LocalKeyframe& keyframe : local.keyframes) {
      for (const auto landmark : map.keyframes()[keyframe.id].*seen_by) {
        if (landmark.valid()) (keyframe.*indices_of).push_back(index[landmark.value]);
      }
    }
  };
  collect(&Keyframe::points, &LocalKeyframe::points, map.points().ids_used(), [&](std::uint32_t i) {
    const Point& p = map.points()[PointId{i}];
    local.points.push_back({PointId{i}, p.position, p.normal, p.min_distance, p.max_distance, p.descriptor,
                            static_cast<int>(p.observations.size())});
  });
  collect(&Keyframe::lines, &LocalKeyframe::lines, map.lines().ids_used(), [&](std::uint32_t i) {
    const Line& l = map.lines()[LineId{i}];
    local.lines.push_back({LineId{i}, l.line, l.start, l.end, l.contrast,
                           static_cast<int>(l.observations.size()), weight_of(map, l)});
  });
  return local;
}

}  // namespace ipl_slam
