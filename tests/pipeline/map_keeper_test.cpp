#include "pipeline/map_keeper.hpp"

#include <gtest/gtest.h>

#include "support/candidate.hpp"
#include "support/map_checks.hpp"

namespace ipl_slam {
namespace {

using namespace test;

constexpr double kElsewhere = KeyframeWalk::kElsewhere;
// A walk of some perfect views: what bundle adjustment, which stops where it gains little, leaves.
constexpr double kSettled = 0.01;

Config test_config() {
  Config config;
  config.depth = kTestNoise;
  return config;
}

// 15 cm to the side: odometry of a step between two views that show nothing of each other.
const SE3 kDrift(Eigen::Quaterniond::Identity(), {0.15, 0.0, 0.0});

struct Kept {
  explicit Kept(const Config& config = test_config()) : keeper(kTestCamera, config) {}

  // Three views of a place; the first one is reached with an error of odometry.
  std::shared_ptr<const LocalMap> visit(double degrees, const SE3& error = {}) {
    std::shared_ptr<const LocalMap> local;
    for (int i = 0; i < 3; ++i) {
      const View view = walk.look(degrees, i);
      const bool first = keeper.map().keyframes().size() == 0;
      local = keeper.add(first ? walk.start(view) : walk.step(view, keeper.map(), i == 0 ? error : SE3{}));
    }
    return local;
  }
  // The same in a part of its own.
  std::shared_ptr<const LocalMap> visit_in_new_part(double degrees) {
    std::shared_ptr<const LocalMap> local = keeper.add(walk.start(walk.look(degrees, 0)));
    for (int i = 1; i < 3; ++i) local = keeper.add(walk.step(walk.look(degrees, i), keeper.map()));
    return local;
  }
  [[nodiscard]] SE3 newest_pose() const { return keeper.map().pose_of(keeper.map().newest_keyframe()); }

  KeyframeWalk walk;
  MapKeeper keeper;
};

TEST(MapKeeper, WithoutAPlaceSeenTwiceNothingHappens) {
  Kept kept;
  kept.visit(0.0);
  const auto local = kept.visit(kElsewhere);
  EXPECT_TRUE(kept.keeper.events().empty());
  EXPECT_FALSE(kept.keeper.wants_global_bundle());
  EXPECT_EQ(local->corrections, 0);
  EXPECT_FALSE(local->found);
  EXPECT_LT(pose_difference(kept.newest_pose(), KeyframeWalk::pose(kElsewhere, 2)), kSettled);
}

TEST(MapKeeper, ALoopIsClosedAndTold) {
  Kept kept;
  kept.visit(0.0);
  kept.visit(kElsewhere, kDrift);
  ASSERT_GT(pose_difference(kept.newest_pose(), KeyframeWalk::pose(kElsewhere, 2)), 0.1);
  const auto local = kept.visit(0.0);
  ASSERT_EQ(kept.keeper.events().size(), 1U);
  const PlaceEvent& event = kept.keeper.events()[0];
  EXPECT_EQ(event.kind, PlaceEvent::Kind::kLoop);
  EXPECT_EQ(event.frame_index, 8U) << "neighbours must confirm: it takes all three views";
  EXPECT_LT(event.known_index, 3U);
  EXPECT_GT(event.inliers, 40);
  EXPECT_NEAR(event.translation, 0.15, kSettled);
  EXPECT_LT(event.rotation, kSettled);
  EXPECT_EQ(local->corrections, 1);
  EXPECT_LT(pose_difference(kept.newest_pose(), KeyframeWalk::pose(0.0, 2)), kSettled);
  EXPECT_EQ(kept.keeper.map().loops().size(), 1U);
  EXPECT_TRUE(kept.keeper.wants_global_bundle());
  expect_consistent(kept.keeper.map());
}

TEST(MapKeeper, NothingIsRecognisedWhereThatIsSwitchedOff) {
  Config config = test_config();
  config.loops.enabled = false;
  Kept kept(config);
  kept.visit(0.0);
  kept.visit(kElsewhere, kDrift);
  kept.visit(0.0);
  EXPECT_TRUE(kept.keeper.events().empty());
  EXPECT_TRUE(kept.keeper.map().loops().empty());
  EXPECT_FALSE(kept.keeper.find_place(lost_frame(kept.walk.look(0.0, 1))));
}

TEST(MapKeeper, APartThatShowsAKnownPlaceIsJoinedToItsPart) {
  Kept kept;
  kept.visit(0.0);
  // Its world frame has other axes: the first keyframe of a part says where it stands in it.
  const View first = kept.walk.look(0.0, 0);
  const SE3 T_mw = SE3::exp((Vector6d() << 3.0, -1.0, 2.0, 0.3, 1.0, -0.5).finished());
  KeyframeCandidate start = kept.walk.start(first);
  start.tracked.T_cw = first.T_cw * T_mw.inverse();
  EXPECT_EQ(kept.keeper.add(start)->part, PartId{1});
  EXPECT_EQ(kept.keeper.map().parts().size(), 2U);
  (void)kept.keeper.add(kept.walk.step(kept.walk.look(0.0, 1), kept.keeper.map()));
  const auto local = kept.keeper.add(kept.walk.step(kept.walk.look(0.0, 2), kept.keeper.map()));
  ASSERT_EQ(kept.keeper.events().size(), 1U);
  EXPECT_EQ(kept.keeper.events()[0].kind, PlaceEvent::Kind::kMerge);
  EXPECT_EQ(kept.keeper.map().parts(), std::vector{PartId{0}});
  EXPECT_EQ(local->part, PartId{0});
  EXPECT_EQ(local->corrections, 1);
  EXPECT_LT(pose_difference(kept.newest_pose(), KeyframeWalk::pose(0.0, 2)), kSettled);
  expect_consistent(kept.keeper.map());
}

TEST(MapKeeper, ALostFrameIsFoundInWhateverPart) {
  Kept kept;
  kept.visit(0.0);
  kept.visit_in_new_part(kElsewhere);
  const View view = kept.walk.look(0.0, 1);
  const auto place = kept.keeper.find_place(lost_frame(view));
  ASSERT_TRUE(place);
  const auto& local = place->map;
  ASSERT_TRUE(local->found);
  EXPECT_LT(pose_difference(*local->found, view.T_cw), kSettled);
  EXPECT_EQ(local->part, PartId{0});
  EXPECT_LT(local->centre, KeyframeId{3});
  EXPECT_EQ(local->corrections, 0) << "the map stays as it is";
  EXPECT_EQ(place->event.kind, PlaceEvent::Kind::kRelocalized);
  EXPECT_EQ(place->event.frame_index, view.frame->index);
  EXPECT_TRUE(kept.keeper.events().empty()) << "whether it is of use shows when the frame is tracked there";
  EXPECT_EQ(kept.keeper.find_place(lost_frame(kept.walk.look(kElsewhere, 1)))->map->part, PartId{1});
}

TEST(MapKeeper, AFrameOfAPlaceNeverSeenIsNotFound) {
  Kept kept;
  EXPECT_FALSE(kept.keeper.find_place(lost_frame(kept.walk.look(0.0, 0)))) << "there is no map";
  kept.visit(0.0);
  EXPECT_FALSE(kept.keeper.find_place(lost_frame(kept.walk.look(kElsewhere, 0))));
  TrackedFrame removed = lost_frame(kept.walk.look(0.0, 1));
  removed.weights.points.assign(removed.points.size(), 0.0);
  EXPECT_FALSE(kept.keeper.find_place(removed)) << "what is removed as dynamic tells nothing";
  EXPECT_TRUE(kept.keeper.events().empty());
}

TEST(MapKeeper, GoesOnWithAMapThatWasLoaded) {
  Kept before;
  before.visit(0.0);
  MapKeeper after(kTestCamera, test_config(), before.keeper.map());
  ASSERT_TRUE(after.around_newest());
  EXPECT_EQ(after.around_newest()->centre, KeyframeId{2});
  const auto place = after.find_place(lost_frame(before.walk.look(0.0, 1)));
  ASSERT_TRUE(place) << "its places are known";
  EXPECT_TRUE(place->map->found);
}

TEST(MapKeeper, ALocalMapIsThereAroundAKeyframeThatWasTakenOutToo) {
  Kept kept;
  EXPECT_FALSE(kept.keeper.around_newest());
  kept.visit(0.0);
  Map map = kept.keeper.map();
  map.remove_keyframe(KeyframeId{1});
  const MapKeeper keeper(kTestCamera, test_config(), map);
  EXPECT_EQ(keeper.around(KeyframeId{1})->centre, map.surviving(KeyframeId{1}));
}

Config without_pause() {
  Config config = test_config();
  config.loops.pause = 0;
  return config;
}

// A map in which a loop was just closed; the next place may be recognised at once.
struct LoopClosed : Kept {
  LoopClosed() : Kept(without_pause()) {
    visit(0.0);
    visit(kElsewhere, kDrift);
    visit(0.0);
  }
};

TEST(MapKeeperGlobalBundle, IsWantedOncePerLoopAndCountsAsACorrection) {
  LoopClosed kept;
  ASSERT_TRUE(kept.keeper.wants_global_bundle());
  GlobalBundle bundle = kept.keeper.begin_global_bundle();
  EXPECT_FALSE(kept.keeper.wants_global_bundle());
  ASSERT_TRUE(bundle.solve());
  kept.keeper.apply(bundle);
  EXPECT_FALSE(kept.keeper.wants_global_bundle());
  EXPECT_EQ(kept.keeper.around_newest()->corrections, 2);
  EXPECT_LT(pose_difference(kept.newest_pose(), KeyframeWalk::pose(0.0, 2)), kSettled);
  expect_consistent(kept.keeper.map());
}

TEST(MapKeeperGlobalBundle, ThatAFurtherCorrectionOvertookIsDroppedAndWantedAnew) {
  LoopClosed kept;
  ASSERT_TRUE(kept.keeper.wants_global_bundle());
  GlobalBundle bundle = kept.keeper.begin_global_bundle();
  ASSERT_TRUE(bundle.solve());
  kept.visit_in_new_part(0.0);
  ASSERT_EQ(kept.keeper.events().back().kind, PlaceEvent::Kind::kMerge);
  const SE3 before = kept.newest_pose();
  kept.keeper.apply(bundle);
  EXPECT_EQ(kept.newest_pose().translation(), before.translation());
  EXPECT_EQ(kept.newest_pose().rotation().coeffs(), before.rotation().coeffs());
  EXPECT_EQ(kept.keeper.around_newest()->corrections, 2) << "the loop and the merge";
  ASSERT_TRUE(kept.keeper.wants_global_bundle());
  GlobalBundle again = kept.keeper.begin_global_bundle();
  ASSERT_TRUE(again.solve());
  kept.keeper.apply(again);
  EXPECT_EQ(kept.keeper.around_newest()->corrections, 3);
  EXPECT_FALSE(kept.keeper.wants_global_bundle());
}

TEST(MapKeeperGlobalBundle, ThatWasAbortedIsWantedAnew) {
  LoopClosed kept;
  ASSERT_TRUE(kept.keeper.wants_global_bundle());
  GlobalBundle bundle = kept.keeper.begin_global_bundle();
  const std::atomic<bool> abort = true;
  ASSERT_FALSE(bundle.solve(&abort));
  kept.keeper.apply(bundle);
  EXPECT_EQ(kept.keeper.around_newest()->corrections, 1);
  EXPECT_TRUE(kept.keeper.wants_global_bundle());
}

TEST(PlaceEvents, HaveNames) {
  EXPECT_STREQ(to_string(PlaceEvent::Kind::kLoop), "loop");
  EXPECT_STREQ(to_string(PlaceEvent::Kind::kMerge), "merge");
  EXPECT_STREQ(to_string(PlaceEvent::Kind::kRelocalized), "relocalized");
}

}  // namespace
}  // namespace ipl_slam
