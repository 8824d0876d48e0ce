// The tracker where the map is more than what lies around the camera: places it is found at, parts, and
// corrections of the whole.

#include <gtest/gtest.h>

#include "support/world_map.hpp"
#include "tracking/tracker.hpp"

namespace ipl_slam {
namespace {

using namespace test;

// What float pixels and depths leave.
constexpr double kExact = 1e-5;

// Walks to the right and a little forward, turning.
SE3 on_path(std::size_t index) {
  const double t = static_cast<double>(index);
  return camera_at({0.01 * t, 0.0, 0.004 * t}, 0.004 * t, 0.002 * t);
}

double seconds(std::size_t index) {
  return static_cast<double>(index) / 30.0;
}

// A tracker and the map of a world it has seen frame 0 of.
struct Started {
  explicit Started(const TrackerOptions& options = {})
      : tracker(kTestCamera, kTestPyramid, kTestNoise, options) {
    const View first = world.look(on_path(0), 0);
    TrackedFrame tracked = tracker.track(first.frame, nullptr);
    map.add(first);
    local = map.snapshot();
    tracked.state = TrackingState::kTracking;
    tracked.reference = KeyframeId{0};
    tracker.start(tracked);
  }
  TrackedFrame track(std::size_t index, const ViewOptions& options = {}) {
    return tracker.track(world.look(on_path(index), index, options).frame, local);
  }
  TrackedFrame track_empty(std::size_t index) {
    return tracker.track(SyntheticWorld::make_frame({}, index), local);
  }
  // All of the map moves: by 30 degrees and more than a metre.
  void move_map(const SE3& T_wn) {
    for (std::uint32_t i = 0; i < map.map.keyframes().ids_used(); ++i) {
      map.map.set_pose(KeyframeId{i}, map.map.pose_of(KeyframeId{i}) * T_wn);
    }
    std::vector<PointId> points;
    map.map.points().for_each([&](PointId id, const Point&) { points.push_back(id); });
    for (const PointId id : points) {
      map.map.set_position(id, T_wn.inverse() * map.map.points()[id].position);
      map.map.refresh(id);
    }
  }
  // The local map as it is now, after so many corrections.
  [[nodiscard]] std::shared_ptr<const LocalMap> snapshot(int corrections) const {
    LocalMap copy = *map.snapshot();
    copy.corrections = corrections;
    return std::make_shared<const LocalMap>(std::move(copy));
  }

  SyntheticWorld world;
  WorldMap map{world};
  Tracker tracker;
  std::shared_ptr<const LocalMap> local;
};

const SE3 kMove = SE3::exp((Vector6d() << 0.8, -0.4, 0.9, 0.1, 0.5, -0.2).finished());

// Another world, in a part of its own whose world frame is filled with the same numbers.
struct OtherPart {
  OtherPart() {
    map.map.add_keyframe(SyntheticWorld::make_frame({}), camera_at({100.0, 0.0, 0.0}));  // takes up id 0
    map.add(world.look(on_path(0), 0));
    LocalMap copy = *map.snapshot();
    copy.part = PartId{1};
    local = std::make_shared<const LocalMap>(std::move(copy));
  }
  SyntheticWorld world{99};
  WorldMap map{world};
  std::shared_ptr<const LocalMap> local;
};

// Without depth a frame cannot be compared with keyframes: only a pose that is nearly right leads to one.
constexpr ViewOptions kWithoutDepth{.depth_share = 0.0};

TEST(TrackerFound, ALostCameraIsTakenUpWhereItWasFound) {
  for (const bool found : {false, true}) {
    Started s;
    (void)s.track(1);
    ASSERT_EQ(s.track_empty(2).state, TrackingState::kLost);
    const SE3 elsewhere = camera_at({2.0, 0.3, 0.5}, -0.5, 0.4);
    s.map.add(s.world.look(camera_at({2.1, 0.3, 0.5}, -0.5, 0.3), 50));
    LocalMap around = *s.map.snapshot();
    // As the place was recognised, from matches of a few pixels and centimetres.
    if (found)
      around.found = SE3::exp((Vector6d() << 0.01, -0.01, 0.01, 0.002, 0.003, -0.002).finished()) * elsewhere;
    const TrackedFrame tracked = s.tracker.track(s.world.look(elsewhere, 51, kWithoutDepth).frame,
                                                 std::make_shared<const LocalMap>(around));
    EXPECT_EQ(tracked.state, found ? TrackingState::kTracking : TrackingState::kLost);
    if (found) {
      EXPECT_LT(pose_difference(tracked.T_cw, elsewhere), kExact);
    }
  }
}

TEST(TrackerFound, APlaceThatIsWrongIsNotBelieved) {
  Started s;
  ASSERT_EQ(s.track_empty(1).state, TrackingState::kLost);
  LocalMap around = *s.local;
  around.found = on_path(0);
  const SyntheticWorld elsewhere(7);
  const TrackedFrame tracked =
      s.tracker.track(elsewhere.look(on_path(0), 2).frame, std::make_shared<const LocalMap>(around));
  EXPECT_EQ(tracked.state, TrackingState::kLost);
}

TEST(TrackerFound, ACameraThatIsNotLostGoesOnByPrediction) {
  Started s;
  (void)s.track(1);
  LocalMap around = *s.local;
  around.found = camera_at({-3.0, 0.0, 0.0}, 1.0);
  s.local = std::make_shared<const LocalMap>(around);
  const TrackedFrame tracked = s.track(2, kWithoutDepth);
  EXPECT_EQ(tracked.state, TrackingState::kTracking);
  EXPECT_LT(pose_difference(tracked.T_cw, on_path(2)), kExact);
}

TEST(TrackerParts, APoseInOnePartIsNoneInAnother) {
  Started s;
  for (std::size_t i = 1; i <= 3; ++i) (void)s.track(i);
  ASSERT_TRUE(s.tracker.expected_pose(seconds(4)));
  const OtherPart other;
  const View still_there = s.world.look(on_path(4), 4);
  const std::vector<std::uint8_t> all(still_there.frame->features.size(), 1);
  EXPECT_FALSE(s.tracker.first_pose(*still_there.frame, other.local, all));
  EXPECT_FALSE(s.tracker.expected_pose(seconds(4)));
  EXPECT_EQ(s.tracker.track(still_there.frame, other.local).state, TrackingState::kLost)
      << "what it sees is not in that part, though it is where the camera was in its own";
}

TEST(TrackerParts, GoesOnInAnotherPartWithoutTheSpeedItHad) {
  Started s;
  for (std::size_t i = 1; i <= 3; ++i) (void)s.track(i);
  const OtherPart other;
  const SE3 there = camera_at({0.5, 0.1, 0.0}, 0.1);
  const TrackedFrame tracked = s.tracker.track(other.world.look(there, 4).frame, other.local);
  ASSERT_EQ(tracked.state, TrackingState::kTracking);
  EXPECT_EQ(tracked.reference, KeyframeId{1});
  EXPECT_LT(pose_difference(tracked.T_cw, there), kExact);
  const std::optional<SE3> expected = s.tracker.expected_pose(seconds(5));
  ASSERT_TRUE(expected);
  EXPECT_LT(pose_difference(expected->inverse(), tracked.T_cw), 1e-12)
      << "of a motion between two worlds nothing is known";
}

TEST(TrackerParts, APartThatIsStartedIsTrackedFromItsFirstFrameOn) {
  Started s;
  for (std::size_t i = 1; i <= 3; ++i) (void)s.track(i);
  const OtherPart other;
  TrackedFrame first;
  first.frame = other.world.look(on_path(0), 10).frame;
  first.points.resize(first.frame->features.size());
  first.state = TrackingState::kTracking;
  first.reference = KeyframeId{1};
  s.tracker.start(first);
  EXPECT_FALSE(s.tracker.expected_pose(seconds(11))) << "not in the part that was left";
  for (std::size_t i = 1; i <= 5; ++i) {
    // Without depth: by prediction from the first frame.
    const TrackedFrame tracked =
        s.tracker.track(other.world.look(on_path(i), 10 + i, kWithoutDepth).frame, other.local);
    ASSERT_EQ(tracked.state, TrackingState::kTracking);
    EXPECT_LT(pose_difference(tracked.T_cw, on_path(i)), kExact);
  }
}

TEST(TrackerCorrections, OfTheMapLeaveThePathOfTheOdometryWithoutAJump) {
  Started s;
  const auto odometry = [&](const TrackedFrame& tracked) {
    return s.tracker.T_ow() * tracked.T_cw.inverse();
  };
  for (std::size_t i = 1; i <= 5; ++i) {
    EXPECT_LT(pose_difference(odometry(s.track(i)), on_path(i).inverse()), kExact);
  }
  s.move_map(kMove);
  s.local = s.snapshot(1);
  for (std::size_t i = 6; i <= 10; ++i) {
    const TrackedFrame tracked = s.track(i, kWithoutDepth);
    ASSERT_EQ(tracked.state, TrackingState::kTracking);
    EXPECT_LT(pose_difference(tracked.T_cw, on_path(i) * kMove), kExact)
        << "in the world of the map it jumps";
    EXPECT_LT(pose_difference(odometry(tracked), on_path(i).inverse()), kExact);
  }
}

TEST(TrackerCorrections, OfTheLastKeyframesAloneDoNotMoveTheOdometry) {
  Started s;
  for (std::size_t i = 1; i <= 3; ++i) (void)s.track(i);
  s.move_map(SE3::exp((Vector6d() << 0.01, 0.0, 0.0, 0.0, 0.001, 0.0).finished()));
  s.local = s.snapshot(0);
  (void)s.track(4);
  EXPECT_EQ(pose_difference(s.tracker.T_ow(), SE3{}), 0.0);
}

TEST(TrackerCorrections, WithoutItsReferenceACameraDoesNotKnowWhereItLiesNow) {
  for (const int corrections : {0, 1}) {
    Started s;
    (void)s.track(1);
    LocalMap without = *s.snapshot(corrections);
    without.keyframes[0].id = without.centre = KeyframeId{7};
    const View view = s.world.look(on_path(2), 2);
    const std::vector<std::uint8_t> all(view.frame->features.size(), 1);
    const bool known =
        s.tracker.first_pose(*view.frame, std::make_shared<const LocalMap>(without), all).has_value();
    EXPECT_EQ(known, corrections == 0);
  }
}

TEST(TrackerGivesUp, AfterItWasLostForSoLong) {
  TrackerOptions options;
  options.new_part_after = 0.5;
  Started s(options);
  (void)s.track(1);
  EXPECT_FALSE(s.tracker.given_up(seconds(1000))) << "it is not lost";
  for (std::size_t i = 2; i <= 30; ++i) {
    ASSERT_EQ(s.track_empty(i).state, TrackingState::kLost);
    // Lost since frame 2. Half a second is 15 frames; the one in which rounding decides is left out.
    if (i != 17) {
      EXPECT_EQ(s.tracker.given_up(seconds(i)), i > 17) << "at frame " << i;
    }
  }
  ASSERT_EQ(s.track(31).state, TrackingState::kTracking);
  EXPECT_FALSE(s.tracker.given_up(seconds(1000)));
  ASSERT_EQ(s.track_empty(32).state, TrackingState::kLost);
  EXPECT_FALSE(s.tracker.given_up(seconds(33))) << "the clock starts anew";
}

TEST(TrackerGivesUp, NeverWhereThatIsSwitchedOff) {
  TrackerOptions options;
  options.new_part_after = 0.0;
  Started s(options);
  ASSERT_EQ(s.track_empty(1).state, TrackingState::kLost);
  EXPECT_FALSE(s.tracker.given_up(1e6));
}

TEST(TrackerStarts, NoMapFromFeaturesThatWereRemoved) {
  const SyntheticWorld world;
  const View view = world.look(on_path(0));
  const std::size_t keypoints = view.frame->features.size();
  TrackerOptions options;
  options.min_initial_depths = static_cast<int>(keypoints / 2);
  const Tracker tracker(kTestCamera, kTestPyramid, kTestNoise, options);
  const auto can_start = [&](std::size_t removed) {
    FeatureWeights weights;
    weights.points.assign(keypoints, 1.0);
    std::fill_n(weights.points.begin(), removed, 0.0);
    return tracker.can_start_map(*view.frame, nullptr, weights);
  };
  EXPECT_TRUE(can_start(0));
  EXPECT_TRUE(can_start(keypoints / 3));
  EXPECT_FALSE(can_start(keypoints * 2 / 3));
  EXPECT_FALSE(can_start(keypoints));
}

}  // namespace
}  // namespace ipl_slam
