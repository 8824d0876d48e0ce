#pragma once

#include <algorithm>
#include <set>
#include <vector>

#include "map/map.hpp"

namespace ipl_slam {

/// The landmarks of one kind that any of the keyframes sees, in order of id. `seen`: Keyframe::points or
/// Keyframe::lines.
template <class LandmarkId>
[[nodiscard]] std::vector<LandmarkId> seen_landmarks(const Map& map, const std::set<KeyframeId>& keyframes,
                                                     std::vector<LandmarkId> Keyframe::*seen) {
  std::vector<LandmarkId> landmarks;
  for (const KeyframeId id : keyframes) {
    for (const LandmarkId landmark : map.keyframes()[id].*seen) {
      if (landmark.valid()) landmarks.push_back(landmark);
    }
  }
  std::sort(landmarks.begin(), landmarks.end());
  landmarks.erase(std::unique(landmarks.begin(), landmarks.end()), landmarks.end());
  return landmarks;
}

}  // namespace ipl_slam
