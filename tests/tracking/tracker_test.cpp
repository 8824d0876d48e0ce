#include "tracking/tracker.hpp"

#include <map>

#include <gtest/gtest.h>

#include "support/world_map.hpp"

namespace ipl_slam {
namespace {

using namespace test;

const ViewOptions kNoisy{.pixel_noise = 0.5, .inverse_depth_noise = 0.01, .flipped_bits = 20};
// Half a pixel is 3 mm at 3 m; what hundreds of landmarks leave of that is a few millimetres and
// milliradians.
constexpr double kSettled = 0.01;
// What float pixels and depths leave.
constexpr double kExact = 1e-5;

// Walks to the right and a little forward, turning.
SE3 on_path(std::size_t index) {
  const double t = static_cast<double>(index);
  return camera_at({0.01 * t, 0.0, 0.004 * t}, 0.004 * t, 0.002 * t);
}

// A tracker whose map was started with frame 0 of the path, and perfect landmarks.
struct Started {
  explicit Started(const TrackerOptions& options = {}, const ViewOptions& view = {})
      : tracker(kTestCamera, kTestPyramid, kTestNoise, options) {
    const View first = world.look(on_path(0), 0, view);
    TrackedFrame tracked = tracker.track(first.frame, nullptr);
    map.add(first);
    local = map.snapshot();
    tracked.state = TrackingState::kTracking;
    tracked.reference = KeyframeId{0};
    tracker.start(tracked);
  }
  TrackedFrame track(std::size_t index, const ViewOptions& options = {}) {
    last = world.look(on_path(index), index, options);
    return tracker.track(last.frame, local);
  }
  TrackedFrame track_empty(std::size_t index) {
    return tracker.track(SyntheticWorld::make_frame({}, index), local);
  }
  // How many keypoints of the last frame are said to see a landmark that they do not show.
  [[nodiscard]] int mistaken(const TrackedFrame& tracked) const {
    int count = 0;
    for (std::size_t k = 0; k < last.sources.size(); ++k) {
      if (tracked.points[k].valid() && tracked.points[k] != map.point_of(last.sources[k])) ++count;
    }
    return count;
  }

  SyntheticWorld world;
  WorldMap map{world};
  Tracker tracker;
  std::shared_ptr<const LocalMap> local;
  View last;
};

TEST(Tracker, IsInitialisingUntilThereIsAMap) {
  const SyntheticWorld world;
  Tracker tracker(kTestCamera, kTestPyramid, kTestNoise, {});
  const View view = world.look(on_path(0));
  const TrackedFrame tracked = tracker.track(view.frame, nullptr);
  EXPECT_EQ(tracked.state, TrackingState::kInitializing);
  EXPECT_EQ(pose_difference(tracked.T_cw, SE3{}), 0.0);
  EXPECT_FALSE(tracked.reference.valid());
  EXPECT_EQ(tracked.points.size(), view.frame->features.size());
  EXPECT_EQ(tracked.frame, view.frame);
}

TEST(Tracker, NeedsEnoughDepthsToStartAMap) {
  const SyntheticWorld world;
  TrackerOptions options;
  const auto with_depth = [&](double share) {
    const View view = world.look(on_path(0), 0, {.depth_share = share});
    options.min_initial_depths = static_cast<int>(view.frame->features.size() / 2);
    return Tracker(kTestCamera, kTestPyramid, kTestNoise, options).can_start_map(*view.frame);
  };
  EXPECT_TRUE(with_depth(1.0));
  EXPECT_TRUE(with_depth(0.7));
  EXPECT_FALSE(with_depth(0.3));
  EXPECT_FALSE(with_depth(0.0));
}

TEST(Tracker, FollowsTheCameraExactlyInAPerfectWorld) {
  Started s;
  for (std::size_t i = 1; i <= 20; ++i) {
    const TrackedFrame tracked = s.track(i);
    ASSERT_EQ(tracked.state, TrackingState::kTracking);
    EXPECT_LT(pose_difference(tracked.T_cw, on_path(i)), kExact);
    EXPECT_EQ(s.mistaken(tracked), 0);
  }
}

TEST(Tracker, FollowsTheCameraThroughNoiseAndClutter) {
  Started s;
  ViewOptions options = kNoisy;
  options.clutter_share = 0.5;
  for (std::size_t i = 1; i <= 20; ++i) {
    const TrackedFrame tracked = s.track(i, options);
    ASSERT_EQ(tracked.state, TrackingState::kTracking);
    EXPECT_LT(pose_difference(tracked.T_cw, on_path(i)), kSettled);
    EXPECT_EQ(s.mistaken(tracked), 0);
  }
}

TEST(Tracker, SaysWhereItIsRelativeToItsReference) {
  Started s;
  const TrackedFrame tracked = s.track(1);
  ASSERT_EQ(tracked.reference, KeyframeId{0});
  EXPECT_LT(pose_difference(tracked.T_c_reference, on_path(1) * on_path(0).inverse()), kExact);
  int landmarks = 0;
  for (const PointId id : tracked.points) landmarks += id.valid() ? 1 : 0;
  EXPECT_EQ(landmarks, tracked.inliers) << "the landmarks it names are the inliers";
}

TEST(Tracker, TheReferenceIsTheKeyframeThatSharesMost) {
  Started s;
  s.map.add(s.world.look(on_path(60), 60));  // elsewhere
  s.local = s.map.snapshot();
  for (std::size_t i = 1; i <= 55; ++i) {
    const TrackedFrame tracked = s.track(i);
    ASSERT_EQ(tracked.state, TrackingState::kTracking);
    if (i > 5 && i < 50) continue;  // where it changes is not the point
    EXPECT_EQ(tracked.reference, KeyframeId{i <= 5 ? 0U : 1U}) << "at frame " << i;
  }
}

TEST(Tracker, KeypointsWithoutDepthAreTrackedAgainstTheMap) {
  Started s;
  for (std::size_t i = 1; i <= 10; ++i) {
    const TrackedFrame tracked = s.track(i, {.depth_share = 0.0});
    ASSERT_EQ(tracked.state, TrackingState::kTracking);
    EXPECT_LT(pose_difference(tracked.T_cw, on_path(i)), kExact);
    EXPECT_GT(tracked.inliers, 300);
  }
}

TEST(Tracker, DroppedFramesDoNotStopIt) {
  Started s;
  for (const std::size_t i : {1, 2, 3, 9, 10, 16}) {
    const TrackedFrame tracked = s.track(i);
    ASSERT_EQ(tracked.state, TrackingState::kTracking);
    EXPECT_LT(pose_difference(tracked.T_cw, on_path(i)), kExact);
  }
}

TEST(Tracker, IsLostWhereItKnowsNothingAndRecoversWhereItDoes) {
  Started s;
  for (std::size_t i = 1; i <= 5; ++i) (void)s.track(i);
  const SyntheticWorld elsewhere(99);
  for (std::size_t i = 6; i <= 8; ++i) {
    const View view = elsewhere.look(on_path(i), i);
    const TrackedFrame tracked = s.tracker.track(view.frame, s.local);
    EXPECT_EQ(tracked.state, TrackingState::kLost);
    EXPECT_LT(pose_difference(tracked.T_cw, on_path(5)), kExact) << "the last pose known";
    EXPECT_EQ(tracked.reference, KeyframeId{0});
    ASSERT_EQ(tracked.points.size(), view.frame->features.size());
    for (const PointId id : tracked.points) EXPECT_FALSE(id.valid());
  }
  // Comes back from where it has never been, too far for any prediction.
  for (std::size_t i = 40; i <= 45; ++i) {
    const TrackedFrame tracked = s.track(i, kNoisy);
    ASSERT_EQ(tracked.state, TrackingState::kTracking);
    EXPECT_LT(pose_difference(tracked.T_cw, on_path(i)), kSettled);
  }
}

TEST(Tracker, ALostCameraTriesAllOfTheLocalMapInTime) {
  TrackerOptions options;
  options.relocalization_keyframes = 1;
  Started s(options);
  // Nearer to where the camera was last than the keyframe that shows the place, and of no help.
  s.map.map.add_keyframe(SyntheticWorld::make_frame({}, 1), s.last.T_cw);
  s.local = s.map.snapshot();
  ASSERT_EQ(s.local->keyframes.size(), 2U);
  int lost = 0;
  for (std::size_t i = 1; i <= 2; ++i) lost += s.track_empty(i).state == TrackingState::kLost ? 1 : 0;
  ASSERT_EQ(lost, 2);
  bool found = false;
  for (std::size_t i = 3; i <= 4; ++i) found |= s.track(i).state == TrackingState::kTracking;
  EXPECT_TRUE(found) << "two frames, one keyframe each";
}

TEST(Tracker, AJumpIsNoLoss) {
  Started s;
  (void)s.track(1);
  const TrackedFrame tracked = s.track(40);  // 40 cm and some degrees at once
  EXPECT_EQ(tracked.state, TrackingState::kTracking);
  EXPECT_LT(pose_difference(tracked.T_cw, on_path(40)), kExact);
}

TEST(Tracker, AsksForMoreLandmarksWhileItIsLost) {
  TrackerOptions options;
  options.min_inliers_recovering = 100000;
  Started s(options);
  ASSERT_EQ(s.track(1).state, TrackingState::kTracking);
  ASSERT_EQ(s.track_empty(2).state, TrackingState::kLost);
  EXPECT_EQ(s.track(3).state, TrackingState::kLost);
}

TEST(Tracker, EmptyFramesAreLostButNeverNotANumber) {
  Started s;
  (void)s.track(1);
  for (std::size_t i = 2; i <= 4; ++i) {
    const TrackedFrame tracked = s.track_empty(i);
    EXPECT_EQ(tracked.state, TrackingState::kLost);
    EXPECT_EQ(tracked.inliers, 0);
    EXPECT_LT(pose_difference(tracked.T_cw, on_path(1)), kExact);
  }
  const TrackedFrame tracked = s.track(5);
  EXPECT_EQ(tracked.state, TrackingState::kTracking);
  EXPECT_LT(pose_difference(tracked.T_cw, on_path(5)), kExact);
}

TEST(Tracker, AnEmptyFrameCannotStartAMap) {
  const Tracker tracker(kTestCamera, kTestPyramid, kTestNoise, {});
  EXPECT_FALSE(tracker.can_start_map(*SyntheticWorld::make_frame({})));
}

TEST(Tracker, FollowsAMapThatMoves) {
  Started s;
  for (std::size_t i = 1; i <= 5; ++i) (void)s.track(i);
  // The whole map moves: by 30 degrees and more than a metre, which no search window would bridge.
  const SE3 T_wn = SE3::exp((Vector6d() << 0.8, -0.4, 0.9, 0.1, 0.5, -0.2).finished());
  s.map.map.set_pose(KeyframeId{0}, on_path(0) * T_wn);
  std::vector<PointId> points;
  s.map.map.points().for_each([&](PointId id, const Point&) { points.push_back(id); });
  for (const PointId id : points) {
    s.map.map.set_position(id, T_wn.inverse() * s.map.map.points()[id].position);
    s.map.map.refresh(id);
  }
  s.local = s.map.snapshot();
  for (std::size_t i = 6; i <= 10; ++i) {
    // Without depth there is no relocalisation: only the prediction can find the map again.
    const TrackedFrame tracked = s.track(i, {.depth_share = 0.0});
    ASSERT_EQ(tracked.state, TrackingState::kTracking);
    EXPECT_LT(pose_difference(tracked.T_cw, on_path(i) * T_wn), kExact);
  }
}

TEST(Tracker, ALandmarkThatIsGoneIsCarriedByItsDepth) {
  Started s;
  for (std::size_t i = 1; i <= 3; ++i) (void)s.track(i);
  // Most landmarks leave the map; the last frame's keypoints still lead to the next pose.
  for (std::uint32_t i = 0; i < s.world.size(); ++i) {
    if (s.map.point_of(i).valid() && i % 4 != 0) s.map.map.remove(s.map.point_of(i));
  }
  s.local = s.map.snapshot();
  const TrackedFrame tracked = s.track(4);
  EXPECT_EQ(tracked.state, TrackingState::kTracking);
  EXPECT_LT(pose_difference(tracked.T_cw, on_path(4)), kExact);
  for (const PointId id : tracked.points) EXPECT_TRUE(!id.valid() || s.map.map.points().contains(id));
}

using Counts = std::map<PointId, std::pair<int, int>>;

Counts sum_of(const std::vector<Sighting<PointId>>& sightings) {
  Counts counts;
  for (const Sighting<PointId>& sighting : sightings) {
    counts[sighting.landmark].first += sighting.visible;
    counts[sighting.landmark].second += sighting.found;
  }
  return counts;
}

TEST(TrackerSightings, CountEveryLandmarkOncePerFrame) {
  Started s;
  const int frames = 3;
  Counts expected;
  for (std::size_t i = 1; i <= frames; ++i) {
    const TrackedFrame tracked = s.track(i);
    for (const PointId id : tracked.points) {
      if (id.valid()) ++expected[id].second;
    }
  }
  const Counts counts = sum_of(s.tracker.take_sightings());
  EXPECT_GT(counts.size(), 300U);
  for (const auto& [id, count] : counts) {
    EXPECT_LE(count.second, count.first) << "found without being visible";
    EXPECT_LE(count.first, frames);
    EXPECT_EQ(count.second, expected[id].second);
  }
}

TEST(TrackerSightings, AreHandedOverOnce) {
  Started s;
  (void)s.track(1);
  EXPECT_FALSE(s.tracker.take_sightings().empty());
  EXPECT_TRUE(s.tracker.take_sightings().empty());
  (void)s.track(2);
  for (const auto& [id, count] : sum_of(s.tracker.take_sightings())) EXPECT_EQ(count.first, 1);
}

TEST(TrackerSightings, SurviveANewLocalMap) {
  Started s;
  (void)s.track(1);
  s.local = s.map.snapshot();
  const TrackedFrame tracked = s.track(2);
  const Counts counts = sum_of(s.tracker.take_sightings());
  for (const PointId id : tracked.points) {
    if (!id.valid()) continue;
    EXPECT_EQ(counts.at(id).second, 2);
  }
}

TEST(TrackerSightings, ALandmarkThatIsHiddenIsVisibleButNotFound) {
  Started s;
  // A third of what is there shows as something else.
  const TrackedFrame tracked = s.track(1, {.clutter_share = 0.33});
  ASSERT_EQ(tracked.state, TrackingState::kTracking);
  const Counts counts = sum_of(s.tracker.take_sightings());
  int visible = 0, found = 0;
  for (const auto& [id, count] : counts) {
    visible += count.first;
    found += count.second;
  }
  EXPECT_EQ(found, tracked.inliers);
  EXPECT_NEAR(static_cast<double>(found) / visible, 0.67, 0.08);  // 2.5 % deviation of some 400 coins
}

TEST(TrackerSightings, AFrameThatIsLostSaysNothingAboutLandmarks) {
  TrackerOptions options;
  options.min_inliers = 100000;
  Started s(options);
  ASSERT_EQ(s.track(1).state, TrackingState::kLost);
  EXPECT_TRUE(s.tracker.take_sightings().empty());
}

TEST(Tracker, GivesTheSameBitsEveryTime) {
  ViewOptions options = kNoisy;
  options.clutter_share = 0.3;
  const auto run = [&] {
    Started s;
    std::vector<double> numbers;
    for (const std::size_t i : {1, 2, 3, 30, 31}) {  // with a relocalisation between
      const TrackedFrame tracked = s.track(i, options);
      for (int k = 0; k < 3; ++k) numbers.push_back(tracked.T_cw.translation()[k]);
      for (int k = 0; k < 4; ++k) numbers.push_back(tracked.T_cw.rotation().coeffs()[k]);
      numbers.push_back(tracked.inliers);
    }
    return numbers;
  };
  EXPECT_EQ(run(), run());
}

}  // namespace
}  // namespace ipl_slam
