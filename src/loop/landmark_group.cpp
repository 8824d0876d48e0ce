#include "loop/landmark_group.hpp"

#include <set>

#include "mapping/seen_landmarks.hpp"

namespace ipl_slam {

LandmarkGroup landmarks_around(const Map& map, KeyframeId id, int neighbours) {
  std::set<KeyframeId> keyframes{id};
  for (const Covisible& neighbour : map.covisible(id)) {
    if (static_cast<int>(keyframes.size()) > neighbours) break;
    keyframes.insert(neighbour.keyframe);
  }
  return {seen_landmarks(map, keyframes, &Keyframe::points),
          seen_landmarks(map, keyframes, &Keyframe::lines)};
}

}  // namespace ipl_slam
