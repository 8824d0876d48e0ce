#include "mapping/keyframe_policy.hpp"

#include <gtest/gtest.h>

#include "support/synthetic_world.hpp"

namespace ipl_slam {
namespace {

using namespace test;

constexpr std::size_t kStart = 1000;  // index of the frame that started the map

// No criterion speaks for a keyframe, each test lets one do so.
struct Situation {
  Situation() {
    options.max_interval = 0.99;  // the 30th frame at 30 frames/s is past it, the 29th is not
    options.min_interval = 0.0;
    options.min_shared = 0.75;
    options.min_close_tracked = 100;
    options.max_close_untracked = 70;
    options.close_depth = 3.0;
  }
  [[nodiscard]] bool wants(bool mapper_idle = true) const {
    KeyframePolicy policy(options);
    policy.started_with(*SyntheticWorld::make_frame({}, kStart));
    return policy.wants(tracked(), map(), mapper_idle);
  }
  [[nodiscard]] TrackedFrame tracked() const {
    Features features;
    TrackedFrame result;
    const auto add = [&](int count, float depth, bool with_landmark) {
      for (int i = 0; i < count; ++i) {
        features.keypoints.emplace_back().depth = depth;
        features.descriptors.emplace_back();
        result.points.push_back(with_landmark ? PointId{0} : PointId{});
      }
    };
    add(close_tracked, 2.0F, true);
    add(close_untracked, 2.0F, false);
    result.weights.points.assign(result.points.size(), 1.0);
    add(close_removed, 2.0F, false);
    result.weights.points.resize(result.points.size(), 0.0);
    add(far_untracked, 3.5F, false);
    add(untracked_without_depth, 0.0F, false);
    result.weights.points.resize(result.points.size(), 1.0);
    result.frame = SyntheticWorld::make_frame(std::move(features), kStart + frames_since);
    result.state = state;
    result.reference = KeyframeId{0};
    result.inliers = inliers;
    return result;
  }
  // The reference keyframe sees `confirmed` landmarks that enough keyframes see and as many that too few do.
  [[nodiscard]] LocalMap map() const {
    LocalMap local;
    for (std::uint32_t id = 0; id < keyframes; ++id)
      local.keyframes.push_back({KeyframeId{id}, {}, {}, {}, {}});
    for (int i = 0; i < 2 * confirmed; ++i) {
      const auto index = static_cast<std::uint32_t>(i);
      local.keyframes[0].points.push_back(index);
      local.points.push_back({PointId{index},
                              Eigen::Vector3d::Zero(),
                              Eigen::Vector3d::UnitZ(),
                              0.0,
                              1.0,
                              {},
                              i % 2 == 0 ? observers : observers - 1});
    }
    return local;
  }

  KeyframePolicyOptions options;
  TrackingState state = TrackingState::kTracking;
  std::size_t frames_since = 5;
  int close_tracked = 300, close_untracked = 0, close_removed = 0, far_untracked = 0,
      untracked_without_depth = 0;
  int inliers = 300, confirmed = 300, observers = 3;
  std::uint32_t keyframes = 5;
};

TEST(KeyframePolicy, WantsNothingWhereNothingSpeaksForIt) {
  const Situation s;
  EXPECT_FALSE(s.wants());
}

TEST(KeyframePolicy, AKeyframeIsOverdueAfterTheLongestInterval) {
  Situation s;
  s.frames_since = 29;
  EXPECT_FALSE(s.wants());
  s.frames_since = 30;
  EXPECT_TRUE(s.wants());
  EXPECT_FALSE(s.wants(false)) << "what is only overdue can wait for the mapper";
}

TEST(KeyframePolicy, LeavingTheReferenceCallsForAKeyframe) {
  Situation s;
  s.inliers = 225;  // of 300 confirmed
  EXPECT_FALSE(s.wants());
  s.inliers = 224;
  EXPECT_TRUE(s.wants());
  EXPECT_FALSE(s.wants(false)) << "there is still enough to track by";
}

TEST(KeyframePolicy, LosingTheReferenceDoesNotWaitForTheMapper) {
  Situation s;
  s.inliers = 75;
  EXPECT_FALSE(s.wants(false));
  s.inliers = 74;
  EXPECT_TRUE(s.wants(false));
}

TEST(KeyframePolicy, AYoungMapConfirmsALandmarkByOneObservation) {
  Situation s;
  s.inliers = 200;
  s.observers = 1;
  EXPECT_FALSE(s.wants()) << "nothing is confirmed that could be missed";
  s.keyframes = 2;
  EXPECT_TRUE(s.wants());
}

TEST(KeyframePolicy, CloseKeypointsWithoutLandmarkCallForAKeyframeWhereLandmarksAreFew) {
  Situation s;
  s.close_tracked = 99;
  s.close_untracked = 70;
  EXPECT_FALSE(s.wants());
  s.close_untracked = 71;
  EXPECT_TRUE(s.wants());
  EXPECT_TRUE(s.wants(false)) << "tracking may soon have nothing to go by";
  s.close_tracked = 100;
  EXPECT_FALSE(s.wants());
}

TEST(KeyframePolicy, FarKeypointsAndThoseWithoutDepthAreNotClose) {
  Situation s;
  s.close_tracked = 99;
  s.far_untracked = 500;
  s.untracked_without_depth = 500;
  EXPECT_FALSE(s.wants());
}

TEST(KeyframePolicy, RemovedKeypointsAreNotMissingALandmark) {
  Situation s;
  s.close_tracked = 99;
  s.close_untracked = 70;
  s.close_removed = 500;
  EXPECT_FALSE(s.wants()) << "they must not get one";
  s.close_untracked = 71;
  EXPECT_TRUE(s.wants());
}

TEST(KeyframePolicy, NoKeyframeComesSoonerThanTheShortestInterval) {
  Situation s;
  s.options.min_interval = 0.15;
  s.inliers = 10;
  s.frames_since = 4;
  EXPECT_FALSE(s.wants());
  EXPECT_FALSE(s.wants(false));
  s.frames_since = 5;
  EXPECT_TRUE(s.wants());
}

TEST(KeyframePolicy, OnlyTrackedFramesBecomeKeyframes) {
  Situation s;
  s.inliers = 10;
  ASSERT_TRUE(s.wants());
  s.state = TrackingState::kLost;
  EXPECT_FALSE(s.wants());
  s.state = TrackingState::kInitializing;
  EXPECT_FALSE(s.wants());
}

TEST(KeyframePolicy, CountsFromTheKeyframeItLastAskedFor) {
  Situation s;
  KeyframePolicy policy(s.options);
  policy.started_with(*SyntheticWorld::make_frame({}, kStart));
  std::vector<std::size_t> wanted;
  for (s.frames_since = 1; s.frames_since <= 100; ++s.frames_since) {
    if (policy.wants(s.tracked(), s.map(), true)) wanted.push_back(s.frames_since);
  }
  EXPECT_EQ(wanted, (std::vector<std::size_t>{30, 60, 90}));
}

TEST(KeyframePolicy, AnEmptyFrameOrMapIsNoTrouble) {
  Situation s;
  s.close_tracked = s.inliers = s.confirmed = 0;
  EXPECT_FALSE(s.wants());
  s.frames_since = 30;
  EXPECT_TRUE(s.wants());
}

}  // namespace
}  // namespace ipl_slam
