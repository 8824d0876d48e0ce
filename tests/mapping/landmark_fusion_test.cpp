#include "mapping/landmark_fusion.hpp"

#include <gtest/gtest.h>

#include "support/map_checks.hpp"
#include "support/world_map.hpp"

namespace ipl_slam {
namespace {

using namespace test;

const SE3 kLeft = camera_at({-0.1, 0.0, 0.0});
const SE3 kRight = camera_at({0.1, 0.0, 0.0}, 0.05);

LandmarkFusion fusion() {
  return {kTestCamera, kTestPyramid, kTestNoise, {}};
}

// Two keyframes of the same things. The first one's landmarks are those of `map`; the second knows nothing of
// them.
struct Pair {
  explicit Pair(const ViewOptions& options = {}) : view(world.look(kRight, 1, options)) {
    left = map.add(world.look(kLeft, 0));
    right = map.map.add_keyframe(view.frame, view.T_cw);
    for (std::uint32_t i = 0; i < world.size(); ++i) {
      if (map.point_of(i).valid() && view.keypoint_of(i) >= 0) shown_twice.push_back(i);
    }
  }
  // Landmarks of its own for the second keyframe, one per keypoint.
  void make_duplicates(const Eigen::Vector3d& offset = Eigen::Vector3d::Zero()) {
    for (std::uint32_t k = 0; k < view.sources.size(); ++k) {
      duplicates.push_back(map.map.add_point(world.position(view.sources[k]) + offset, right, k));
    }
  }
  [[nodiscard]] std::vector<PointId> points_of(KeyframeId id) const {
    std::vector<PointId> points;
    for (const PointId point : map.map.keyframes()[id].points) {
      if (point.valid()) points.push_back(point);
    }
    return points;
  }
  // How many things shown twice are one landmark that both keyframes see.
  [[nodiscard]] std::size_t united() const {
    std::size_t count = 0;
    for (const std::uint32_t i : shown_twice) {
      const PointId seen_right = map.map.keyframes()[right].points[view.keypoint_of(i)];
      if (seen_right.valid() && seen_right == map.map.resolve(map.point_of(i))) ++count;
    }
    return count;
  }

  SyntheticWorld world;
  WorldMap map{world};
  View view;
  KeyframeId left, right;
  std::vector<std::uint32_t> shown_twice;
  std::vector<PointId> duplicates;
};

TEST(LandmarkFusion, FreeKeypointsSeeTheLandmarksThatProjectOntoThem) {
  Pair p;
  ASSERT_GT(p.shown_twice.size(), 300U);
  fusion().fuse_into(p.map.map, p.right, p.points_of(p.left));
  EXPECT_EQ(p.united(), p.shown_twice.size());
  EXPECT_EQ(p.points_of(p.right).size(), p.shown_twice.size()) << "and nothing else";
  expect_consistent(p.map.map);
}

TEST(LandmarkFusion, JoinsLandmarksThatAreTheSame) {
  Pair p;
  p.make_duplicates();
  const std::size_t before = p.map.map.points().size();
  fusion().fuse_into(p.map.map, p.right, p.points_of(p.left));
  EXPECT_EQ(p.united(), p.shown_twice.size());
  EXPECT_EQ(p.map.map.points().size(), before - p.shown_twice.size());
  expect_consistent(p.map.map);
}

TEST(LandmarkFusion, TheOneSeenByMoreKeyframesStays) {
  Pair p;
  p.make_duplicates();
  // A third keyframe sees the second one's landmark as well.
  const std::uint32_t source = p.shown_twice[10];
  const auto keypoint = static_cast<std::uint32_t>(p.view.keypoint_of(source));
  const KeyframeId third = p.map.map.add_keyframe(p.view.frame, p.view.T_cw);
  p.map.map.add_observation(p.duplicates[keypoint], third, keypoint);
  fusion().fuse_into(p.map.map, p.right, p.points_of(p.left));
  EXPECT_EQ(p.map.map.resolve(p.map.point_of(source)), p.duplicates[keypoint]);
  EXPECT_EQ(p.map.map.points()[p.duplicates[keypoint]].observations.size(), 3U);
  expect_consistent(p.map.map);
}

TEST(LandmarkFusion, RespectsDisagreementInTheImage) {
  Pair p;
  // Four pixels or a little more to the side: chi-square with depth allows 2.8 pixels of the keypoint's
  // level, the search window reaches to 3.
  p.map.map.set_pose(p.right, camera_at({0.1, 0.0, 0.0}, 0.05 + 4.0 / 525.0));
  const auto& features = p.view.frame->features;
  fusion().fuse_into(p.map.map, p.right, p.points_of(p.left));
  std::size_t coarse = 0;
  for (const std::uint32_t i : p.shown_twice) {
    const auto keypoint = static_cast<std::size_t>(p.view.keypoint_of(i));
    const double scale = kTestPyramid.scale(features.keypoints[keypoint].level);
    const bool seen = p.map.map.keyframes()[p.right].points[keypoint].valid();
    EXPECT_TRUE(!seen || 2.8 * scale > 4.0) << "at a scale of " << scale;
    coarse += seen ? 1 : 0;
  }
  EXPECT_GT(coarse, 0U) << "at coarse levels the same offset is within the noise";
  EXPECT_LT(coarse, p.shown_twice.size());
}

TEST(LandmarkFusion, RespectsDisagreementInDepth) {
  Pair p;
  // In the same direction but farther: 0.05 / m is five deviations.
  std::vector<PointId> candidates;
  const Eigen::Vector3d centre = p.view.T_cw.inverse().translation();
  for (const std::uint32_t i : p.shown_twice) {
    const double z = (p.view.T_cw * p.world.position(i)).z();
    const double farther = 1.0 / (1.0 / z - 0.05) / z;
    p.map.map.set_position(p.map.point_of(i), centre + farther * (p.world.position(i) - centre));
    candidates.push_back(p.map.point_of(i));
  }
  fusion().fuse_into(p.map.map, p.right, candidates);
  EXPECT_EQ(p.points_of(p.right).size(), 0U);
}

TEST(LandmarkFusion, WithoutDepthThePixelDecides) {
  Pair p({.depth_share = 0.0});
  fusion().fuse_into(p.map.map, p.right, p.points_of(p.left));
  EXPECT_EQ(p.united(), p.shown_twice.size());
}

TEST(LandmarkFusion, DoesNotJoinWhatLooksDifferent) {
  Pair p({.clutter_share = 1.0});
  fusion().fuse_into(p.map.map, p.right, p.points_of(p.left));
  EXPECT_TRUE(p.points_of(p.right).empty());
}

TEST(LandmarkFusion, WorksBothWaysAroundAKeyframe) {
  Pair p;
  // The two share twenty landmarks, which makes them neighbours; the rest is doubled.
  for (std::uint32_t n = 0; n < 20; ++n) {
    const std::uint32_t i = p.shown_twice[n];
    p.map.map.add_observation(p.map.point_of(i), p.right, static_cast<std::uint32_t>(p.view.keypoint_of(i)));
  }
  for (std::uint32_t k = 0; k < p.view.sources.size(); ++k) {
    if (p.map.map.keyframes()[p.right].points[k].valid()) continue;
    if (k % 2 == 0) p.map.map.add_point(p.world.position(p.view.sources[k]), p.right, k);
  }
  fusion().fuse_around(p.map.map, p.right);
  EXPECT_EQ(p.united(), p.shown_twice.size());
  expect_consistent(p.map.map);
  // Doing it again changes nothing.
  const std::size_t points = p.map.map.points().size();
  fusion().fuse_around(p.map.map, p.right);
  EXPECT_EQ(p.map.map.points().size(), points);
}

TEST(LandmarkFusion, AKeyframeWithoutNeighboursStaysAsItIs) {
  Pair p;
  p.make_duplicates();
  const std::size_t before = p.map.map.points().size();
  fusion().fuse_around(p.map.map, p.right);
  EXPECT_EQ(p.map.map.points().size(), before);
}

}  // namespace
}  // namespace ipl_slam
