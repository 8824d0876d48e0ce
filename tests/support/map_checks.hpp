#pragma once

#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

#include "map/map.hpp"

namespace ipl_slam::test {

/// Landmarks of one kind: those of `landmarks` and those in `seen` of each keyframe. Fails the test where the
/// two directions of an observation disagree, a landmark has no observation left, or its observations are out
/// of order.
template <class LandmarkId, class Landmark>
void expect_consistent(const Map& map, const Store<LandmarkId, Landmark>& landmarks,
                       std::vector<LandmarkId> Keyframe::*seen) {
  std::size_t from_landmarks = 0, from_keyframes = 0;
  landmarks.for_each([&](LandmarkId id, const Landmark& landmark) {
    EXPECT_FALSE(landmark.observations.empty()) << "landmark " << id.value << " is seen by nothing";
    EXPECT_EQ(map.resolve(id), id) << "a landmark that is in the map is what it has become";
    for (std::size_t i = 0; i < landmark.observations.size(); ++i) {
      const Observation& o = landmark.observations[i];
      ++from_landmarks;
      ASSERT_TRUE(map.keyframes().contains(o.keyframe)) << "landmark " << id.value << " is seen by a ghost";
      const std::vector<LandmarkId>& slots = map.keyframes()[o.keyframe].*seen;
      ASSERT_LT(o.feature, slots.size());
      EXPECT_EQ(slots[o.feature], id);
      if (i > 0) {
        EXPECT_LT(landmark.observations[i - 1].keyframe, o.keyframe);
      }
    }
  });
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    for (const LandmarkId landmark : keyframe.*seen) {
      if (!landmark.valid()) continue;
      ++from_keyframes;
      ASSERT_TRUE(landmarks.contains(landmark)) << "keyframe " << id.value << " sees a ghost";
    }
  });
  EXPECT_EQ(from_landmarks, from_keyframes);
}

/// Fails the test where the map contradicts itself: in its observations, in the number of slots of a
/// keyframe, or in the ends of a line, which lie on it in its direction.
inline void expect_consistent(const Map& map) {
  expect_consistent(map, map.points(), &Keyframe::points);
  expect_consistent(map, map.lines(), &Keyframe::lines);
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    EXPECT_EQ(keyframe.points.size(), keyframe.frame->features.size());
    ASSERT_TRUE(keyframe.line_features);
    EXPECT_EQ(keyframe.lines.size(), keyframe.line_features->size());
  });
  map.lines().for_each([&](LineId id, const Line& line) {
    EXPECT_NEAR(line.line.direction.norm(), 1.0, 1e-9) << "line " << id.value;
    EXPECT_NEAR(line.line.direction.dot(line.line.moment), 0.0, 1e-9) << "line " << id.value;
    // A micrometre: rounding, within some metres of the origin.
    for (const Eigen::Vector3d& end : {line.start, line.end}) {
      EXPECT_LT(line.line.distance(end), 1e-6) << "an end lies beside line " << id.value;
    }
    EXPECT_GT(line.line.direction.dot(line.end - line.start), 0.0)
        << "line " << id.value << " runs backwards";
  });
}

}  // namespace ipl_slam::test
