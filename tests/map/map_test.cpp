#include "map/map.hpp"

#include <gtest/gtest.h>

#include "support/bare_frame.hpp"
#include "support/map_checks.hpp"
#include "support/synthetic_world.hpp"

namespace ipl_slam {
namespace {

using namespace test;

// Keyframes in a row along x, a metre apart, looking along z.
struct Row {
  explicit Row(int count, std::size_t keypoints = 20) {
    for (int i = 0; i < count; ++i) {
      keyframes.push_back(map.add_keyframe(bare_frame(keypoints), camera_at({1.0 * i, 0.0, 0.0})));
    }
  }
  // A point seen by these keyframes (indices into the row), at the next free keypoint of each.
  PointId point(const std::vector<int>& observers, const Eigen::Vector3d& position = {0.0, 0.0, 2.0}) {
    PointId id;
    for (const int i : observers) {
      const std::uint32_t keypoint = next[static_cast<std::size_t>(i)]++;
      if (id.valid()) map.add_observation(id, keyframes[i], keypoint);
      if (!id.valid()) id = map.add_point(position, keyframes[i], keypoint);
    }
    return id;
  }
  [[nodiscard]] std::vector<std::uint32_t> observers_of(PointId id) const {
    std::vector<std::uint32_t> result;
    for (const Observation& o : map.points()[id].observations) result.push_back(o.keyframe.value);
    return result;
  }

  Map map{kTestPyramid};
  std::vector<KeyframeId> keyframes;
  std::vector<std::uint32_t> next = std::vector<std::uint32_t>(100, 0);
};

TEST(Map, StartsAPointWithItsFirstObservation) {
  Row row(2);
  const PointId id = row.map.add_point({0.0, 0.0, 2.0}, row.keyframes[0], 7);
  EXPECT_EQ(row.map.keyframes()[row.keyframes[0]].points[7], id);
  EXPECT_TRUE(row.map.observes(row.keyframes[0], id));
  EXPECT_FALSE(row.map.observes(row.keyframes[1], id));
  EXPECT_EQ(row.map.points()[id].first_keyframe, row.keyframes[1]) << "the newest when it was made";
  expect_consistent(row.map);
}

TEST(Map, KeepsObservationsInOrderOfKeyframe) {
  Row row(4);
  const PointId id = row.point({2, 0, 3, 1});
  EXPECT_EQ(row.observers_of(id), (std::vector<std::uint32_t>{0, 1, 2, 3}));
  expect_consistent(row.map);
}

TEST(Map, AKeyframeSeesAPointOnce) {
  Row row(1);
  const PointId id = row.point({0});
  row.map.add_observation(id, row.keyframes[0], 9);
  EXPECT_EQ(row.observers_of(id).size(), 1U);
  EXPECT_FALSE(row.map.keyframes()[row.keyframes[0]].points[9].valid());
  expect_consistent(row.map);
}

TEST(Map, AKeypointSeesOnePoint) {
  Row row(2);
  const PointId first = row.point({0});
  const PointId second = row.point({1});
  row.map.add_observation(second, row.keyframes[0], 0);
  EXPECT_EQ(row.map.keyframes()[row.keyframes[0]].points[0], first);
  EXPECT_EQ(row.observers_of(second), (std::vector<std::uint32_t>{1}));
  expect_consistent(row.map);
}

TEST(Map, APointDiesWithItsLastObservation) {
  Row row(2);
  const PointId id = row.point({0, 1});
  row.map.remove_observation(id, row.keyframes[0]);
  EXPECT_TRUE(row.map.points().contains(id));
  expect_consistent(row.map);
  row.map.remove_observation(id, row.keyframes[1]);
  EXPECT_FALSE(row.map.points().contains(id));
  EXPECT_FALSE(row.map.resolve(id).valid());
  expect_consistent(row.map);
}

TEST(Map, RemovingAnObservationThatIsNotThereChangesNothing) {
  Row row(2);
  const PointId id = row.point({0});
  row.map.remove_observation(id, row.keyframes[1]);
  EXPECT_EQ(row.observers_of(id), (std::vector<std::uint32_t>{0}));
  expect_consistent(row.map);
}

TEST(Map, RemovingAPointFreesItsKeypoints) {
  Row row(3);
  const PointId id = row.point({0, 1, 2});
  row.map.remove(id);
  for (const KeyframeId keyframe : row.keyframes) {
    EXPECT_FALSE(row.map.keyframes()[keyframe].points[0].valid());
  }
  EXPECT_FALSE(row.map.points().contains(id));
  expect_consistent(row.map);
}

TEST(Map, RemovingAKeyframeTakesItsObservationsAndItsOwnPointsAlong) {
  Row row(3);
  const PointId shared = row.point({0, 1});
  const PointId own = row.point({1});
  row.map.remove_keyframe(row.keyframes[1]);
  EXPECT_FALSE(row.map.keyframes().contains(row.keyframes[1]));
  EXPECT_FALSE(row.map.points().contains(own));
  EXPECT_EQ(row.observers_of(shared), (std::vector<std::uint32_t>{0}));
  expect_consistent(row.map);
}

TEST(Map, FusingMovesObservationsAndSightings) {
  Row row(4);
  const PointId kept = row.point({0, 1}, {0.0, 0.0, 2.0});
  const PointId gone = row.point({2, 3}, {0.1, 0.0, 2.0});
  row.map.count_sightings(kept, 4, 3);
  row.map.count_sightings(gone, 20, 10);
  row.map.fuse(kept, gone);
  EXPECT_EQ(row.observers_of(kept), (std::vector<std::uint32_t>{0, 1, 2, 3}));
  EXPECT_EQ(row.map.points()[kept].position, Eigen::Vector3d(0.0, 0.0, 2.0));
  EXPECT_EQ(row.map.points()[kept].visible, 5 + 21);
  EXPECT_EQ(row.map.points()[kept].found, 4 + 11);
  EXPECT_FALSE(row.map.points().contains(gone));
  EXPECT_EQ(row.map.resolve(gone), kept);
  expect_consistent(row.map);
}

TEST(Map, FusingPointsOfOneKeyframeKeepsTheObservationOfTheKeptOne) {
  Row row(2);
  const PointId kept = row.point({0});     // keypoint 0
  const PointId gone = row.point({0, 1});  // keypoint 1 and 0
  row.map.fuse(kept, gone);
  EXPECT_EQ(row.map.keyframes()[row.keyframes[0]].points[0], kept);
  EXPECT_FALSE(row.map.keyframes()[row.keyframes[0]].points[1].valid());
  EXPECT_EQ(row.map.keyframes()[row.keyframes[1]].points[0], kept);
  expect_consistent(row.map);
}

TEST(Map, FusingAPointWithItselfDoesNothing) {
  Row row(2);
  const PointId id = row.point({0, 1});
  row.map.fuse(id, id);
  EXPECT_EQ(row.observers_of(id), (std::vector<std::uint32_t>{0, 1}));
  EXPECT_EQ(row.map.points()[id].visible, 1);
  EXPECT_EQ(row.map.resolve(id), id);
}

TEST(Map, ResolvesThroughAChainOfFusions) {
  Row row(4);
  const PointId a = row.point({0}), b = row.point({1}), c = row.point({2}), d = row.point({3});
  row.map.fuse(b, a);
  row.map.fuse(c, b);
  row.map.fuse(c, d);
  for (const PointId id : {a, b, c, d}) EXPECT_EQ(row.map.resolve(id), c);
  expect_consistent(row.map);
  row.map.remove(c);
  for (const PointId id : {a, b, c, d}) EXPECT_FALSE(row.map.resolve(id).valid());
  EXPECT_FALSE(row.map.resolve(PointId{}).valid());
}

TEST(Map, ANewPointIsNotTakenForTheOneWhoseMemoryItUses) {
  Row row(2);
  const PointId old = row.point({0});
  row.map.remove(old);
  const PointId fresh = row.point({1});
  EXPECT_NE(fresh, old);
  EXPECT_FALSE(row.map.resolve(old).valid());
  EXPECT_EQ(row.map.points()[fresh].found, 1);
}

TEST(Map, StaysConsistentUnderRandomChanges) {
  constexpr int kKeypoints = 12;
  Row row(0);
  Random random(3);
  std::vector<PointId> points;
  std::vector<KeyframeId> keyframes;
  const auto any = [&](const auto& ids) { return ids[random.index(ids.size())]; };
  for (int step = 0; step < 600; ++step) {
    const std::uint64_t choice = keyframes.size() < 3 ? 0 : random.index(12);
    const PointId point = points.empty() ? PointId{} : row.map.resolve(any(points));
    if (choice == 0 && keyframes.size() < 40) {
      keyframes.push_back(row.map.add_keyframe(bare_frame(kKeypoints), SE3{}));
    } else if (choice < 5) {
      const KeyframeId keyframe = any(keyframes);
      const auto keypoint = static_cast<std::uint32_t>(random.index(kKeypoints));
      if (!row.map.keyframes()[keyframe].points[keypoint].valid()) {
        points.push_back(row.map.add_point({0.0, 0.0, 2.0}, keyframe, keypoint));
      }
    } else if (choice < 8 && point.valid()) {
      row.map.add_observation(point, any(keyframes), static_cast<std::uint32_t>(random.index(kKeypoints)));
    } else if (choice == 8 && point.valid()) {
      row.map.remove_observation(point, any(keyframes));
    } else if (choice == 9 && point.valid()) {
      const PointId other = row.map.resolve(any(points));
      if (other.valid()) row.map.fuse(point, other);
    } else if (choice == 10 && step % 5 == 0 && point.valid()) {
      row.map.remove(point);
    } else if (choice == 11 && keyframes.size() > 5) {
      const std::size_t i = 1 + random.index(keyframes.size() - 2);  // neither the anchor nor the newest
      row.map.remove_keyframe(keyframes[i]);
      keyframes.erase(keyframes.begin() + static_cast<std::ptrdiff_t>(i));
    }
    if (step % 10 == 0) expect_consistent(row.map);
    if (HasFatalFailure()) return;
  }
  expect_consistent(row.map);
  EXPECT_GT(row.map.points().size(), 20U) << "the walk should end with a map worth checking";
}

TEST(Map, KnowsTheRelativePlaceOfARemovedKeyframe) {
  Row row(3);
  row.point({0, 1});
  row.point({1, 2});
  row.point({1, 2});
  const SE3 T_12 = row.map.pose_of(row.keyframes[1]) * row.map.pose_of(row.keyframes[2]).inverse();
  row.map.remove_keyframe(row.keyframes[1]);  // shares more with 2 than with 0
  EXPECT_LT(pose_difference(row.map.pose_of(row.keyframes[1]), camera_at({1.0, 0.0, 0.0})), 1e-12);

  const SE3 moved = camera_at({5.0, 1.0, 0.0}, 0.4);
  row.map.set_pose(row.keyframes[2], moved);
  row.map.set_pose(row.keyframes[0], camera_at({-9.0, 0.0, 0.0}));
  // The tolerances of this group are rounding alone.
  EXPECT_LT(pose_difference(row.map.pose_of(row.keyframes[1]), T_12 * moved), 1e-12);
}

TEST(Map, FollowsSeveralRemovedKeyframes) {
  Row row(5);
  for (int i = 0; i < 4; ++i) row.point({i, i + 1});
  row.point({1, 2});  // 1 hangs on 2, 2 on 3, 3 on 4
  row.point({2, 3});
  row.point({2, 3});
  row.point({3, 4});
  row.point({3, 4});
  row.map.remove_keyframe(row.keyframes[2]);
  row.map.remove_keyframe(row.keyframes[1]);
  row.map.remove_keyframe(row.keyframes[3]);
  for (const int i : {1, 2, 3}) {
    EXPECT_LT(pose_difference(row.map.pose_of(row.keyframes[i]), camera_at({1.0 * i, 0.0, 0.0})), 1e-12);
  }
  // All three hang on what is left; what is left moves as one, and they with it.
  const SE3 T_wn = SE3::exp((Vector6d() << 0.3, -0.2, 0.5, 0.1, 0.2, -0.3).finished());
  for (const int i : {0, 4}) {
    row.map.set_pose(row.keyframes[i], row.map.keyframes()[row.keyframes[i]].T_cw * T_wn);
  }
  for (const int i : {1, 2, 3}) {
    const SE3 expected = camera_at({1.0 * i, 0.0, 0.0}) * T_wn;
    EXPECT_LT(pose_difference(row.map.pose_of(row.keyframes[i]), expected), 1e-12);
  }
}

TEST(Map, AKeyframeThatSharesNothingHangsOnTheAnchorOfItsPart) {
  Row row(3);
  row.map.remove_keyframe(row.keyframes[1]);
  row.map.set_pose(row.keyframes[0], camera_at({7.0, 0.0, 0.0}));
  EXPECT_LT(pose_difference(row.map.pose_of(row.keyframes[1]), camera_at({8.0, 0.0, 0.0})), 1e-12);
}

TEST(Map, ListsCovisibleKeyframesByWhatTheyShareThenById) {
  Row row(5);
  row.point({0, 3});
  row.point({0, 3, 1});
  row.point({0, 4});
  row.point({1, 2});
  const auto covisible = row.map.covisible(row.keyframes[0]);
  ASSERT_EQ(covisible.size(), 3U);
  EXPECT_EQ(covisible[0].keyframe, row.keyframes[3]);
  EXPECT_EQ(covisible[0].shared, 2);
  EXPECT_EQ(covisible[1].keyframe, row.keyframes[1]) << "among equals the older comes first";
  EXPECT_EQ(covisible[1].shared, 1);
  EXPECT_EQ(covisible[2].keyframe, row.keyframes[4]);
}

TEST(Map, CovisibleForgetsRemovedKeyframesAndPoints) {
  Row row(3);
  const PointId id = row.point({0, 2});
  row.point({0, 1});
  row.map.remove(id);
  auto covisible = row.map.covisible(row.keyframes[0]);
  ASSERT_EQ(covisible.size(), 1U);
  EXPECT_EQ(covisible[0].keyframe, row.keyframes[1]);
  row.map.remove_keyframe(row.keyframes[1]);
  EXPECT_TRUE(row.map.covisible(row.keyframes[0]).empty());
}

// Three cameras at distances 2, 4 and 4 m around a point; the descriptors differ from the first one by 1 and
// by 3 bits.
struct Refreshed {
  Refreshed() {
    const std::vector<SE3> poses{camera_at({0.0, 0.0, 0.0}), camera_at({0.0, 0.0, -2.0}),
                                 camera_at({4.0, 0.0, 2.0}, -1.57)};
    const std::vector<int> levels{3, 0, 1};
    for (std::size_t i = 0; i < poses.size(); ++i) {
      Features features;
      features.keypoints.resize(1);
      features.keypoints[0].level = levels[i];
      features.descriptors.push_back({i == 0 ? 0x1ULL : i == 1 ? 0x0ULL : 0xFULL, 0, 0, 0});
      keyframes.push_back(map.add_keyframe(SyntheticWorld::make_frame(std::move(features)), poses[i]));
    }
    point = map.add_point({0.0, 0.0, 2.0}, keyframes[0], 0);
    map.add_observation(point, keyframes[1], 0);
    map.add_observation(point, keyframes[2], 0);
    map.refresh(point);
  }
  Map map{kTestPyramid};
  std::vector<KeyframeId> keyframes;
  PointId point;
};

TEST(MapRefresh, TakesTheDescriptorThatLiesAmongTheOthers) {
  const Refreshed r;
  // Distances: 0x1-0x0 1, 0x1-0xF 3, 0x0-0xF 4 bits. The medians of (0, 1, 3), (0, 1, 4) and (0, 3, 4) are 1,
  // 1 and 3; among equals the first keyframe's stays.
  EXPECT_EQ(r.map.points()[r.point].descriptor, (Descriptor{0x1, 0, 0, 0}));
}

TEST(MapRefresh, AnOutlierDescriptorLosesEvenIfItCameFirst) {
  Map map{kTestPyramid};
  PointId point;
  for (const std::uint64_t bits : {0xFFFFULL, 0x0ULL, 0x1ULL}) {
    Features features;
    features.keypoints.resize(1);
    features.descriptors.push_back({bits, 0, 0, 0});
    const KeyframeId id = map.add_keyframe(SyntheticWorld::make_frame(std::move(features)), SE3{});
    if (point.valid()) map.add_observation(point, id, 0);
    if (!point.valid()) point = map.add_point({0.0, 0.0, 1.0}, id, 0);
  }
  map.refresh(point);
  EXPECT_EQ(map.points()[point].descriptor, (Descriptor{0x0, 0, 0, 0}));
}

TEST(MapRefresh, TheNormalIsTheMeanViewingDirection) {
  const Refreshed r;
  const Eigen::Vector3d expected = Eigen::Vector3d(-1.0, 0.0, 2.0).normalized();
  EXPECT_LT((r.map.points()[r.point].normal - expected).norm(), 1e-12);
}

TEST(MapRefresh, TheRangeFollowsDistanceAndLevel) {
  const Refreshed r;
  // Seen from 2 m on level 3, from 4 m on level 0 and from 4 m on level 1: level 0 lies at the mean of these.
  const double expected = (2.0 * 1.728 + 4.0 + 4.0 * 1.2) / 3.0;
  EXPECT_NEAR(r.map.points()[r.point].max_distance, expected, 1e-9);
  EXPECT_NEAR(r.map.points()[r.point].min_distance, expected / std::pow(1.2, 7), 1e-9);
}

TEST(MapRefresh, FollowsARemovedObservation) {
  Refreshed r;
  r.map.remove_observation(r.point, r.keyframes[0]);
  r.map.remove_observation(r.point, r.keyframes[2]);
  r.map.refresh(r.point);
  const Point& point = r.map.points()[r.point];
  EXPECT_EQ(point.descriptor, (Descriptor{0x0, 0, 0, 0}));
  EXPECT_LT((point.normal - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_NEAR(point.max_distance, 4.0, 1e-9);
}

}  // namespace
}  // namespace ipl_slam
