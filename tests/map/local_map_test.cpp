#include "map/local_map.hpp"

#include <numbers>

#include <gtest/gtest.h>

#include "support/line_world.hpp"
#include "support/synthetic_world.hpp"

namespace ipl_slam {
namespace {

using namespace test;

// Keyframes far apart, each sharing points with the next: 0 - 1 - 2 - ... - 9. The newest is the last.
struct Chain {
  explicit Chain(int count = 10, double step = 10.0) {
    for (int i = 0; i < count; ++i) add(camera_at({step * i, 0.0, 0.0}));
    for (int i = 0; i + 1 < count; ++i) {
      const PointId id = map.add_point({step * i, 0.0, 2.0}, keyframes[i], 0);
      map.add_observation(id, keyframes[i + 1], 1);
      map.refresh(id);
    }
  }
  KeyframeId add(const SE3& T_cw) {
    Features features;
    features.keypoints.resize(4);
    features.descriptors.resize(4);
    keyframes.push_back(map.add_keyframe(SyntheticWorld::make_frame(std::move(features)), T_cw));
    return keyframes.back();
  }

  Map map{kTestPyramid};
  std::vector<KeyframeId> keyframes;
};

std::vector<std::uint32_t> ids(const LocalMap& local) {
  std::vector<std::uint32_t> result;
  for (const LocalKeyframe& keyframe : local.keyframes) result.push_back(keyframe.id.value);
  return result;
}

TEST(LocalMap, HoldsTheCovisibleKeyframesAndTheirNeighbours) {
  const Chain chain;
  const LocalMap local = build_local_map(chain.map, chain.keyframes[9], {});
  EXPECT_EQ(ids(local), (std::vector<std::uint32_t>{7, 8, 9}));
}

TEST(LocalMap, LeavesSecondNeighboursOutWhereNoneAreWanted) {
  const Chain chain;
  const LocalMap local = build_local_map(chain.map, chain.keyframes[9], {.neighbours = 0});
  EXPECT_EQ(ids(local), (std::vector<std::uint32_t>{8, 9}));
}

TEST(LocalMap, PrefersThoseThatShareMostWhereThereIsNoRoomForAll) {
  Chain chain;
  chain.map.add_observation(chain.map.keyframes()[chain.keyframes[2]].points[0], chain.keyframes[9], 2);
  chain.map.add_observation(chain.map.keyframes()[chain.keyframes[2]].points[1], chain.keyframes[9], 3);
  // 9 shares two points with 2 and one each with 1, 3 and 8; itself included there is room for two.
  const LocalMap local = build_local_map(chain.map, chain.keyframes[9], {.max_keyframes = 2});
  EXPECT_EQ(ids(local), (std::vector<std::uint32_t>{2, 9}));
}

TEST(LocalMap, NeverHoldsMoreKeyframesThanAllowed) {
  const Chain chain(10, 0.01);  // all are near each other
  for (const int limit : {2, 3, 7, 10, 50}) {
    const LocalMap local = build_local_map(chain.map, chain.keyframes[9], {.max_keyframes = limit});
    EXPECT_EQ(local.keyframes.size(), static_cast<std::size_t>(std::min(limit, 10)));
    EXPECT_EQ(local.keyframes.back().id, chain.keyframes[9]);
  }
}

TEST(LocalMap, AddsKeyframesNearbyThatLookTheSameWay) {
  Chain chain;
  constexpr double kDegree = std::numbers::pi / 180.0;
  const KeyframeId same_way = chain.add(camera_at({0.5, 100.0, 0.0}, 40.0 * kDegree));
  chain.add(camera_at({0.5, 100.0, 0.0}, 50.0 * kDegree));  // looks elsewhere
  chain.add(camera_at({1.5, 100.0, 0.0}));                  // too far
  const KeyframeId centre = chain.add(camera_at({0.0, 100.0, 0.0}));
  const LocalMap local = build_local_map(chain.map, centre, {.nearby_distance = 1.0});
  EXPECT_EQ(ids(local), (std::vector<std::uint32_t>{same_way.value, centre.value}));
}

TEST(LocalMap, TakesTheNearestOfManyNearby) {
  Chain chain;
  chain.add(camera_at({0.9, 100.0, 0.0}));
  const KeyframeId nearest = chain.add(camera_at({0.2, 100.0, 0.0}));
  chain.add(camera_at({0.5, 100.0, 0.0}));
  const KeyframeId centre = chain.add(camera_at({0.0, 100.0, 0.0}));
  const LocalMap local = build_local_map(chain.map, centre, {.max_keyframes = 2});
  EXPECT_EQ(ids(local), (std::vector<std::uint32_t>{nearest.value, centre.value}));
}

TEST(LocalMap, HoldsEveryPointItsKeyframesSeeOnceAndInOrder) {
  const Chain chain;
  const LocalMap local = build_local_map(chain.map, chain.keyframes[9], {});
  // 7, 8 and 9 see the points they share, and the one of 6 and 7.
  ASSERT_EQ(local.points.size(), 3U);
  for (std::size_t i = 0; i < local.points.size(); ++i) {
    EXPECT_EQ(local.points[i].id, PointId{6 + static_cast<std::uint32_t>(i)});
    const Point& point = chain.map.points()[local.points[i].id];
    EXPECT_EQ(local.points[i].position, point.position);
    EXPECT_EQ(local.points[i].normal, point.normal);
    EXPECT_EQ(local.points[i].max_distance, point.max_distance);
    EXPECT_EQ(local.points[i].observations, 2) << "also those of keyframes outside count";
  }
}

TEST(LocalMap, KeyframesPointAtTheirPoints) {
  const Chain chain;
  const LocalMap local = build_local_map(chain.map, chain.keyframes[9], {});
  for (const LocalKeyframe& keyframe : local.keyframes) {
    std::vector<PointId> expected, actual;
    for (const PointId id : chain.map.keyframes()[keyframe.id].points) {
      if (id.valid()) expected.push_back(id);
    }
    for (const std::uint32_t index : keyframe.points) actual.push_back(local.points.at(index).id);
    EXPECT_EQ(actual, expected);
    EXPECT_EQ(keyframe.frame, chain.map.keyframes()[keyframe.id].frame);
  }
}

TEST(LocalMap, FindsWhatItHoldsAndNothingElse) {
  const Chain chain;
  const LocalMap local = build_local_map(chain.map, chain.keyframes[9], {});
  for (const LocalKeyframe& keyframe : local.keyframes) {
    EXPECT_EQ(local.find_keyframe(keyframe.id), &keyframe);
  }
  for (std::size_t i = 0; i < local.points.size(); ++i) {
    EXPECT_EQ(local.find_point(local.points[i].id), static_cast<int>(i));
  }
  EXPECT_EQ(local.find_keyframe(chain.keyframes[0]), nullptr);
  EXPECT_EQ(local.find_keyframe(KeyframeId{}), nullptr);
  EXPECT_EQ(local.find_point(PointId{0}), -1);
  EXPECT_EQ(local.find_point(PointId{}), -1);
}

TEST(LocalMap, DoesNotChangeWithTheMap) {
  Chain chain;
  const LocalMap local = build_local_map(chain.map, chain.keyframes[9], {});
  const Eigen::Vector3d position = local.points[0].position;
  chain.map.set_position(local.points[0].id, {9.0, 9.0, 9.0});
  chain.map.remove_keyframe(chain.keyframes[8]);
  EXPECT_EQ(local.points[0].position, position);
  EXPECT_EQ(local.find_keyframe(chain.keyframes[8])->frame->features.size(), 4U);
}

TEST(LocalMap, OfASingleKeyframeWithoutPointsIsThatKeyframe) {
  Chain chain(1);
  const LocalMap local = build_local_map(chain.map, chain.keyframes[0], {});
  EXPECT_EQ(ids(local), (std::vector<std::uint32_t>{0}));
  EXPECT_TRUE(local.points.empty());
}

// Views of a world of lines from left to right; what lies at the far right shows in the last one alone.
struct LineChain {
  LineChain() {
    for (std::size_t i = 0; i < 4; ++i) {
      map.add(
          world.look(camera_at({0.05 * static_cast<double>(i), 0.0, 0.0}, 0.08 * static_cast<double>(i)), i));
    }
  }
  LineWorld world;
  LineWorldMap map{world};
};

TEST(LocalMap, HoldsEveryLineItsKeyframesSeeOnceAndInOrder) {
  const LineChain chain;
  const LocalMap local = build_local_map(chain.map.map, KeyframeId{3}, {});
  EXPECT_EQ(ids(local), (std::vector<std::uint32_t>{0, 1, 2, 3})) << "lines make neighbours";
  EXPECT_TRUE(local.points.empty());
  ASSERT_EQ(local.lines.size(), chain.map.map.lines().size());
  for (std::size_t i = 0; i < local.lines.size(); ++i) {
    const LocalLine& line = local.lines[i];
    if (i > 0) {
      EXPECT_LT(local.lines[i - 1].id, line.id);
    }
    const Line& original = chain.map.map.lines()[line.id];
    EXPECT_EQ(line.line.moment, original.line.moment);
    EXPECT_EQ(line.line.direction, original.line.direction);
    EXPECT_EQ(line.start, original.start);
    EXPECT_EQ(line.end, original.end);
    EXPECT_EQ(line.contrast, original.contrast);
    EXPECT_EQ(line.observations, static_cast<int>(original.observations.size()));
  }
}

TEST(LocalMap, LeavesOutLinesThatOnlyOtherKeyframesSee) {
  const LineChain chain;
  const LocalMap local =
      build_local_map(chain.map.map, KeyframeId{3}, {.max_keyframes = 2, .nearby_distance = 0.0});
  ASSERT_EQ(local.keyframes.size(), 2U);
  EXPECT_LT(local.lines.size(), chain.map.map.lines().size());
  for (const LocalLine& line : local.lines) {
    bool seen = false;
    for (const LocalKeyframe& keyframe : local.keyframes)
      seen |= chain.map.map.observes(keyframe.id, line.id);
    EXPECT_TRUE(seen);
  }
}

TEST(LocalMap, KeyframesPointAtTheirLines) {
  LineChain chain;
  // Without lines of its own, and with one segment that shows nothing known.
  chain.map.map.add_keyframe(SyntheticWorld::make_frame({}), camera_at({0.1, 0.0, 0.0}));
  chain.map.map.remove(chain.map.map.keyframes()[KeyframeId{1}].lines[3]);
  const LocalMap local = build_local_map(chain.map.map, KeyframeId{3}, {});
  ASSERT_EQ(local.keyframes.size(), 5U);
  for (const LocalKeyframe& keyframe : local.keyframes) {
    std::vector<LineId> expected, actual;
    for (const LineId id : chain.map.map.keyframes()[keyframe.id].lines) {
      if (id.valid()) expected.push_back(id);
    }
    for (const std::uint32_t index : keyframe.lines) actual.push_back(local.lines.at(index).id);
    EXPECT_EQ(actual, expected) << "keyframe " << keyframe.id.value;
  }
  EXPECT_TRUE(local.find_keyframe(KeyframeId{4})->lines.empty());
}

}  // namespace
}  // namespace ipl_slam
