#pragma once

#include <set>

#include "map/map.hpp"

namespace ipl_slam {

[[nodiscard]] inline std::set<KeyframeId> part_keyframes(const Map& map, PartId part) {
  std::set<KeyframeId> keyframes;
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    if (keyframe.part == part) keyframes.insert(id);
  });
  return keyframes;
}

}  // namespace ipl_slam
