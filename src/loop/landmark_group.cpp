#include "loop/landmark_group.hpp"

#include <algorithm>

namespace ipl_slam {
namespace {

template <class LandmarkId>
void append_seen(const std::vector<LandmarkId>& seen, std::vector<LandmarkId>& all) {
  std::copy_if(seen.begin(), seen.end(), std::back_inserter(all), [](LandmarkId id) { return id.valid(); });
}

template <class LandmarkId>
void keep_one_of_each(std::vector<LandmarkId>& ids) {
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
}

}  // namespace

LandmarkGroup landmarks_around(const Map& map, KeyframeId id, int neighbours) {
  std::vector<KeyframeId> keyframes{id};
  for (const Covisible& neighbour : map.covisible(id)) {
    if (static_cast<int>(keyframes.size()) > neighbours) break;
    keyframes.push_back(neighbour.keyframe);
  }
  LandmarkGroup group;
  for (const KeyframeId member : keyframes) {
    append_seen(map.keyframes()[member].points, group.points);
    append_seen(map.keyframes()[member].lines, group.lines);
  }
  keep_one_of_each(group.points);
  keep_one_of_each(group.lines);
  return group;
}

}  // namespace ipl_slam
