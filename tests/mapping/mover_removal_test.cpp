#include "mapping/mover_removal.hpp"

#include <gtest/gtest.h>

#include "support/bare_frame.hpp"
#include "support/map_checks.hpp"

namespace ipl_slam {
namespace {

using namespace test;

constexpr InstanceId kMover{4}, kOther{9};
constexpr std::uint32_t kFeatures = 6;

std::shared_ptr<const LineFeatures> bare_lines() {
  LineFeatures lines;
  lines.segments.resize(kFeatures);
  lines.descriptors.resize(kFeatures);
  return std::make_shared<const LineFeatures>(std::move(lines));
}

// Five keyframes with six keypoints and six segments each. Landmark f of either kind is seen as feature f.
// Features 0 to 2 of the first `inside` keyframes lie on the mover, 3 and 4 on something else, 5 on nothing.
class Scene {
 public:
  static constexpr std::uint32_t kKeyframes = 5;

  explicit Scene(std::uint32_t inside) {
    for (std::uint32_t k = 0; k < kKeyframes; ++k) {
      FeatureTrust trust;
      trust.regions.assign(kFeatures, InstanceId{});
      for (const int f : {0, 1, 2}) trust.regions[f] = k < inside ? kMover : InstanceId{};
      for (const int f : {3, 4}) trust.regions[f] = kOther;
      map.add_keyframe(bare_frame(kFeatures), camera_at({0.1 * k, 0.0, 0.0}), bare_lines(), trust, trust);
    }
  }
  // Landmarks that the first so many keyframes see.
  PointId add_point(std::uint32_t feature, std::uint32_t observers = kKeyframes) {
    const PointId id = map.add_point({0.0, 0.0, 2.0}, KeyframeId{0}, feature);
    for (std::uint32_t k = 1; k < observers; ++k) map.add_observation(id, KeyframeId{k}, feature);
    map.refresh(id);
    return id;
  }
  LineId add_line(std::uint32_t feature, std::uint32_t observers = kKeyframes) {
    const Eigen::Vector3d start(-0.5, 0.2, 2.0), end(0.5, 0.1, 2.5);
    const LineId id = map.add_line(*Line3::through(start, end), start, end, KeyframeId{0}, feature);
    for (std::uint32_t k = 1; k < observers; ++k) map.add_observation(id, KeyframeId{k}, feature);
    map.refresh(id);
    return id;
  }

  Map map{kTestPyramid};
};

TEST(MoverRemoval, TakesOutLandmarksThatAreSeenOnTheMover) {
  Scene scene(5);
  const PointId point = scene.add_point(0), point_beside = scene.add_point(3);
  const LineId line = scene.add_line(1), second_line = scene.add_line(2), line_beside = scene.add_line(5);
  const RemovedLandmarks removed = remove_landmarks_on(scene.map, kMover);
  EXPECT_EQ(removed.points, 1);
  EXPECT_EQ(removed.lines, 2);
  EXPECT_FALSE(scene.map.points().contains(point));
  EXPECT_FALSE(scene.map.lines().contains(line));
  EXPECT_FALSE(scene.map.lines().contains(second_line));
  EXPECT_EQ(scene.map.points()[point_beside].observations.size(), 5U);
  EXPECT_EQ(scene.map.lines()[line_beside].observations.size(), 5U);
  EXPECT_FALSE(scene.map.keyframes()[KeyframeId{0}].points[0].valid());
  expect_consistent(scene.map);
}

TEST(MoverRemoval, MostOfTheObservationsDecide) {
  // Of 5 observations 3 are on the mover.
  Scene scene(3);
  const PointId point = scene.add_point(0);
  const LineId line = scene.add_line(0);
  const RemovedLandmarks removed = remove_landmarks_on(scene.map, kMover);
  EXPECT_EQ(removed.points, 1);
  EXPECT_EQ(removed.lines, 1);
  EXPECT_FALSE(scene.map.points().contains(point));
  EXPECT_FALSE(scene.map.lines().contains(line));
  expect_consistent(scene.map);
}

TEST(MoverRemoval, ALandmarkSeenElsewhereAsOftenLosesTheseObservationsOnly) {
  // Of 4 observations 2 are on the mover.
  Scene scene(2);
  const PointId point = scene.add_point(0, 4);
  const LineId line = scene.add_line(0, 4);
  const RemovedLandmarks removed = remove_landmarks_on(scene.map, kMover);
  EXPECT_EQ(removed.points, 0);
  EXPECT_EQ(removed.lines, 0);
  ASSERT_TRUE(scene.map.points().contains(point));
  ASSERT_TRUE(scene.map.lines().contains(line));
  const auto& points = scene.map.points()[point].observations;
  const auto& lines = scene.map.lines()[line].observations;
  ASSERT_EQ(points.size(), 2U);
  ASSERT_EQ(lines.size(), 2U);
  for (std::uint32_t i = 0; i < 2; ++i) {
    EXPECT_EQ(points[i].keyframe, KeyframeId{2 + i});
    EXPECT_EQ(lines[i].keyframe, KeyframeId{2 + i});
  }
  EXPECT_FALSE(scene.map.keyframes()[KeyframeId{0}].points[0].valid());
  EXPECT_FALSE(scene.map.keyframes()[KeyframeId{0}].lines[0].valid());
  expect_consistent(scene.map);
}

TEST(MoverRemoval, WhatIsLeftOfALandmarkIsDerivedAnew) {
  // The camera of keyframe 0 alone saw it on the mover; those left are at x = 0.1 and 0.2.
  Scene scene(1);
  const PointId point = scene.add_point(0, 3);
  (void)remove_landmarks_on(scene.map, kMover);
  const Eigen::Vector3d first(-0.1, 0.0, 2.0), second(-0.2, 0.0, 2.0);
  const Eigen::Vector3d normal = (first.normalized() + second.normalized()).normalized();
  EXPECT_LT((scene.map.points()[point].normal - normal).norm(), 1e-12);
}

TEST(MoverRemoval, LeavesTheMapAloneWhereNothingWasSeenOnTheMover) {
  Scene scene(0);
  for (std::uint32_t f = 0; f < kFeatures; ++f) (void)scene.add_point(f), (void)scene.add_line(f);
  const RemovedLandmarks removed = remove_landmarks_on(scene.map, kMover);
  EXPECT_EQ(removed.points + removed.lines, 0);
  EXPECT_EQ(scene.map.points().size(), kFeatures);
  EXPECT_EQ(scene.map.lines().size(), kFeatures);
  scene.map.points().for_each([](PointId, const Point& p) { EXPECT_EQ(p.observations.size(), 5U); });
  expect_consistent(scene.map);
}

TEST(MoverRemoval, FeaturesWithoutALandmarkAreNoTrouble) {
  Scene scene(5);
  const RemovedLandmarks removed = remove_landmarks_on(scene.map, kMover);
  EXPECT_EQ(removed.points + removed.lines, 0);
  Map empty{kTestPyramid};
  EXPECT_EQ(remove_landmarks_on(empty, kMover).points, 0);
}

TEST(MoverRemoval, KeyframesWithoutRegionsSawNothingOnIt) {
  Map map{kTestPyramid};
  map.add_keyframe(bare_frame(kFeatures), camera_at({0.0, 0.0, 0.0}));
  FeatureTrust trust;
  trust.regions.assign(kFeatures, kMover);
  map.add_keyframe(bare_frame(kFeatures), camera_at({0.1, 0.0, 0.0}), nullptr, trust);
  const PointId seen_twice = map.add_point({0.0, 0.0, 2.0}, KeyframeId{0}, 0);
  map.add_observation(seen_twice, KeyframeId{1}, 0);
  const PointId seen_on_it = map.add_point({0.0, 0.0, 2.0}, KeyframeId{1}, 1);
  EXPECT_EQ(remove_landmarks_on(map, kMover).points, 1);
  EXPECT_FALSE(map.points().contains(seen_on_it));
  ASSERT_TRUE(map.points().contains(seen_twice));
  EXPECT_EQ(map.points()[seen_twice].observations.size(), 1U);
  expect_consistent(map);
}

TEST(MoverRemoval, ASecondTimeThereIsNothingLeft) {
  Scene scene(2);
  (void)scene.add_point(0, 2);
  (void)scene.add_point(1, 5);
  EXPECT_EQ(remove_landmarks_on(scene.map, kMover).points, 1);
  const RemovedLandmarks again = remove_landmarks_on(scene.map, kMover);
  EXPECT_EQ(again.points + again.lines, 0);
  expect_consistent(scene.map);
}

}  // namespace
}  // namespace ipl_slam
