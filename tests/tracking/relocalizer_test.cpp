#include "tracking/relocalizer.hpp"

#include <gtest/gtest.h>

#include "support/world_map.hpp"

namespace ipl_slam {
namespace {

using namespace test;

const SE3 kTrue = camera_at({0.3, -0.1, 0.2}, 0.15, 0.4);
// A map of three keyframes.
std::shared_ptr<const LocalMap> map_of(const SyntheticWorld& world) {
  WorldMap map(world);
  map.add(world.look(camera_at({-0.6, 0.0, 0.0}), 0));
  map.add(world.look(camera_at({0.0, 0.0, 0.0}), 1));
  map.add(world.look(camera_at({0.6, 0.0, 0.0}), 2));
  return map.snapshot();
}

// From the first keyframe that gives a pose.
std::optional<SE3> find(const View& view, const LocalMap& map, const RelocalizerOptions& options = {}) {
  const Relocalizer relocalizer(kTestCamera, kTestPyramid, options);
  for (const LocalKeyframe& keyframe : map.keyframes) {
    if (const auto T_cw = relocalizer.find_pose(*view.frame, *keyframe.frame, keyframe.T_cw)) return T_cw;
  }
  return std::nullopt;
}

TEST(Relocalizer, FindsTheExactPoseInAPerfectWorld) {
  const SyntheticWorld world;
  const auto T_cw = find(world.look(kTrue, 50), *map_of(world));
  ASSERT_TRUE(T_cw);
  // Pixels and depths are floats: seven digits.
  EXPECT_LT(pose_difference(*T_cw, kTrue), 1e-5);
}

TEST(Relocalizer, FindsThePoseAmongNoiseAndOutliers) {
  const SyntheticWorld world;
  // Two of three keypoints show nothing known, or carry depths that are wrong by decimetres.
  const View view = world.look(
      kTrue, 50, {.pixel_noise = 0.5, .inverse_depth_noise = 0.01, .flipped_bits = 20, .clutter_share = 0.5});
  Features features = view.frame->features;
  Random random(4);
  for (Keypoint& keypoint : features.keypoints) {
    if (random.chance(0.3)) keypoint.depth *= 1.5F;
  }
  const View spoiled{SyntheticWorld::make_frame(std::move(features), 50), view.T_cw, view.sources};
  const auto T_cw = find(spoiled, *map_of(world));
  ASSERT_TRUE(T_cw);
  // The pose may rest on a sample of three, whose depths are 9 cm off at 3 m. It is a start for tracking,
  // which settles the rest.
  EXPECT_LT(pose_difference(*T_cw, kTrue), 0.25);
}

TEST(Relocalizer, FindsNothingInAnotherScene) {
  const SyntheticWorld world(1), elsewhere(2);
  EXPECT_FALSE(find(elsewhere.look(kTrue, 50), *map_of(world)));
}

TEST(Relocalizer, DoesNotBelieveDescriptorsWithoutGeometry) {
  // The same things in other places: all descriptors match, no rigid motion explains them.
  const SyntheticWorld world;
  const View view = world.look(kTrue, 50);
  Features features = view.frame->features;
  Random random(4);
  random.shuffle(features.descriptors);
  for (Keypoint& keypoint : features.keypoints) keypoint.angle = 0.0F;
  const View shuffled{SyntheticWorld::make_frame(std::move(features), 50), view.T_cw, view.sources};
  RelocalizerOptions options;
  options.match.max_rotation = 0.0;
  EXPECT_FALSE(find(shuffled, *map_of(world), options));
}

TEST(Relocalizer, NeedsDepthOnBothSides) {
  const SyntheticWorld world;
  EXPECT_FALSE(find(world.look(kTrue, 50, {.depth_share = 0.0}), *map_of(world)));
}

TEST(Relocalizer, NeedsAsManyMatchesAsItIsAskedFor) {
  const SyntheticWorld world;
  const auto map = map_of(world);
  const View view = world.look(kTrue, 50);
  RelocalizerOptions options;
  options.min_matches = 50;
  EXPECT_TRUE(find(view, *map, options));
  options.min_matches = 1000;
  EXPECT_FALSE(find(view, *map, options));
}

TEST(Relocalizer, AnEmptyFrameIsNowhere) {
  const SyntheticWorld world;
  const View empty{SyntheticWorld::make_frame({}, 50), kTrue, {}};
  EXPECT_FALSE(find(empty, *map_of(world)));
}

TEST(Relocalizer, AnEmptyKeyframeHelpsNobodyButHarmsNobodyEither) {
  const SyntheticWorld world;
  WorldMap map(world);
  map.add(world.look(camera_at({0.0, 0.0, 0.0}), 1));
  map.map.add_keyframe(SyntheticWorld::make_frame({}), camera_at({0.1, 0.0, 0.0}));
  EXPECT_TRUE(find(world.look(kTrue, 50), *map.snapshot()));
}

TEST(Relocalizer, GivesTheSameBitsEveryTime) {
  const SyntheticWorld world;
  const auto map = map_of(world);
  const View view =
      world.look(kTrue, 50, {.pixel_noise = 1.0, .inverse_depth_noise = 0.01, .clutter_share = 0.5});
  const auto first = find(view, *map), second = find(view, *map);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->translation(), second->translation());
  EXPECT_EQ(first->rotation().coeffs(), second->rotation().coeffs());
}

TEST(Relocalizer, DrawsOtherSamplesWithAnotherSeed) {
  const SyntheticWorld world;
  const auto map = map_of(world);
  const View view =
      world.look(kTrue, 50, {.pixel_noise = 1.0, .inverse_depth_noise = 0.01, .clutter_share = 0.5});
  const LocalKeyframe& keyframe = map->keyframes.front();
  const auto pose = [&](std::uint64_t seed) {
    return Relocalizer(kTestCamera, kTestPyramid, {}, seed)
        .find_pose(*view.frame, *keyframe.frame, keyframe.T_cw);
  };
  const auto base = pose(0), again = pose(0);
  ASSERT_TRUE(base && again);
  EXPECT_EQ(pose_difference(*base, *again), 0.0);
  int different = 0;  // two seeds may agree on the inliers, and so on the pose
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const auto other = pose(seed);
    ASSERT_TRUE(other) << seed;
    different += pose_difference(*base, *other) > 0.0 ? 1 : 0;
  }
  EXPECT_GT(different, 0);
}

}  // namespace
}  // namespace ipl_slam
