#pragma once

#include <algorithm>

#include <gtest/gtest.h>

#include "map/map.hpp"

namespace ipl_slam::test {

/// Fails the test where the two directions of an observation disagree, a point has no observation left, or
/// its observations are out of order.
inline void expect_consistent(const Map& map) {
  std::size_t from_points = 0, from_keyframes = 0;
  map.points().for_each([&](PointId id, const Point& point) {
    EXPECT_FALSE(point.observations.empty()) << "point " << id.value << " is seen by nothing";
    EXPECT_EQ(map.resolve(id), id) << "a point that is in the map is what it has become";
    for (std::size_t i = 0; i < point.observations.size(); ++i) {
      const Observation& o = point.observations[i];
      ++from_points;
      ASSERT_TRUE(map.keyframes().contains(o.keyframe)) << "point " << id.value << " is seen by a ghost";
      const Keyframe& keyframe = map.keyframes()[o.keyframe];
      ASSERT_LT(o.feature, keyframe.points.size());
      EXPECT_EQ(keyframe.points[o.feature], id);
      if (i > 0) {
        EXPECT_LT(point.observations[i - 1].keyframe, o.keyframe);
      }
    }
  });
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    ASSERT_EQ(keyframe.points.size(), keyframe.frame->features.size());
    for (const PointId point : keyframe.points) {
      if (!point.valid()) continue;
      ++from_keyframes;
      ASSERT_TRUE(map.points().contains(point)) << "keyframe " << id.value << " sees a ghost";
    }
  });
  EXPECT_EQ(from_points, from_keyframes);
}

}  // namespace ipl_slam::test
