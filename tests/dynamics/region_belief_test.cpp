#include "dynamics/region_belief.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

constexpr InstanceId kSomeone{7};

// What one feature that moved, or did not, says: log odds.
const double kMoved = std::log(5.0);        // 0.5 / 0.1 = 5: 1.609
const double kStill = std::log(5.0 / 9.0);  // (1 - 0.5) / (1 - 0.1): -0.588

RegionBeliefOptions options() {
  RegionBeliefOptions o;
  o.likely_mover = 1.0;
  o.unknown = 0.5;
  o.movable = -1.0;
  o.background = -3.0;
  o.contour = 2.5;
  o.moved_on_mover = 0.5;
  o.moved_on_still = 0.1;
  o.frame_moving = o.frame_still = 2.0;
  o.memory = 0.8;
  o.most_moving = 5.0;
  o.most_still = 3.0;
  return o;
}

RegionBeliefOptions without_caps() {
  RegionBeliefOptions o = options();
  o.frame_moving = o.frame_still = o.most_moving = o.most_still = 1000.0;
  return o;
}

RegionEvidence points(int all, int moved) {
  return {.points = all, .moved_points = moved};
}

TEST(RegionBelief, StartsWithThePriorOfTheClass) {
  const RegionBelief belief(options());
  EXPECT_EQ(belief.prior("person"), 1.0);
  EXPECT_EQ(belief.prior("dog"), 1.0);
  EXPECT_EQ(belief.prior("unknown"), 0.5);
  EXPECT_EQ(belief.prior("chair"), -1.0);
  EXPECT_EQ(belief.prior("bed"), -3.0);
  EXPECT_EQ(belief.prior("no class at all"), -1.0) << "it can be carried as far as anybody knows";
  EXPECT_EQ(belief.of(kSomeone, "person"), 1.0) << "nothing was seen of it yet";
  EXPECT_EQ(belief.of(kSomeone, "bed"), -3.0);
}

TEST(RegionBelief, StaysAtThePriorWhereNothingIsSeen) {
  RegionBelief belief(options());
  for (std::size_t frame = 0; frame < 3; ++frame) {
    EXPECT_EQ(belief.update(kSomeone, frame, "person", {}), 1.0);
    EXPECT_EQ(belief.update(InstanceId{8}, frame, "chair", {}), -1.0);
  }
}

TEST(RegionBelief, AddsTheLogLikelihoodsOfItsPoints) {
  RegionBelief belief(without_caps());
  EXPECT_NEAR(belief.update(InstanceId{0}, 0, "person", points(3, 2)), 1.0 + 2.0 * kMoved + kStill, 1e-12);
  EXPECT_NEAR(belief.update(InstanceId{1}, 0, "person", points(4, 0)), 1.0 + 4.0 * kStill, 1e-12);
  EXPECT_NEAR(belief.update(InstanceId{2}, 0, "chair", points(1, 1)), -1.0 + kMoved, 1e-12);
}

TEST(RegionBelief, LinesCountAsPointsDo) {
  RegionBelief belief(without_caps());
  const RegionEvidence lines{.lines = 3, .moved_lines = 2};
  EXPECT_NEAR(belief.update(InstanceId{0}, 0, "person", lines), 1.0 + 2.0 * kMoved + kStill, 1e-12);
  const RegionEvidence both{.points = 2, .moved_points = 1, .lines = 2, .moved_lines = 0};
  EXPECT_NEAR(belief.update(InstanceId{1}, 0, "person", both), 1.0 + kMoved + 3.0 * kStill, 1e-12);
}

TEST(RegionBelief, PointsSayLessWhereWhatIsStillSeemsToMoveToo) {
  RegionBelief belief(without_caps());
  const auto update = [&](std::uint32_t id, double elsewhere) {
    return belief.update(InstanceId{id}, 0, "person",
                         {.points = 3, .moved_points = 2, .moved_elsewhere = elsewhere});
  };
  EXPECT_NEAR(update(0, 0.05), 1.0 + 2.0 * kMoved + kStill, 1e-12) << "no more than is usual";
  EXPECT_NEAR(update(1, 0.25), 1.0 + 2.0 * std::log(2.0) + std::log(2.0 / 3.0), 1e-12);
  EXPECT_EQ(update(2, 0.5), 1.0) << "as much as on a mover";
  EXPECT_EQ(update(3, 1.0), 1.0);
}

TEST(RegionBelief, OneFrameCountsOnlySoMuch) {
  RegionBelief belief(options());
  EXPECT_NEAR(belief.update(InstanceId{0}, 0, "person", points(100, 100)), 1.0 + 2.0, 1e-12);
  EXPECT_NEAR(belief.update(InstanceId{1}, 0, "person", points(100, 0)), 1.0 - 2.0, 1e-12);
  // Points and lines together: they err together where the pose is wrong.
  const RegionEvidence both{.points = 9, .moved_points = 9, .lines = 9, .moved_lines = 9};
  EXPECT_NEAR(belief.update(InstanceId{2}, 0, "person", both), 1.0 + 2.0, 1e-12);
  EXPECT_NEAR(belief.update(InstanceId{3}, 0, "person", points(1, 1)), 1.0 + kMoved, 1e-12) << "below it";
}

TEST(RegionBelief, RemembersLessWithEveryFrame) {
  RegionBelief belief(options());
  EXPECT_NEAR(belief.update(kSomeone, 0, "chair", points(9, 9)), -1.0 + 2.0, 1e-12);
  EXPECT_NEAR(belief.update(kSomeone, 1, "chair", {}), -1.0 + 1.6, 1e-12);
  EXPECT_NEAR(belief.update(kSomeone, 2, "chair", {}), -1.0 + 1.28, 1e-12);
  EXPECT_NEAR(belief.update(kSomeone, 3, "chair", points(1, 0)), -1.0 + 1.024 + kStill, 1e-12);
  EXPECT_NEAR(belief.of(kSomeone, "chair"), -1.0 + 1.024 + kStill, 1e-12) << "the last update";
}

TEST(RegionBelief, AllFramesTogetherCountLessAgainstMotionThanForIt) {
  RegionBelief belief(options());
  // 2, 3.6, 4.88, then 5.9, which is too much.
  for (const double counted : {2.0, 3.6, 4.88, 5.0, 5.0}) {
    EXPECT_NEAR(belief.update(InstanceId{0}, 0, "person", points(9, 9)), 1.0 + counted, 1e-12);
  }
  // -2, then -3.6, which is too much.
  for (const double counted : {-2.0, -3.0, -3.0}) {
    EXPECT_NEAR(belief.update(InstanceId{1}, 0, "person", points(9, 0)), 1.0 + counted, 1e-12);
  }
}

TEST(RegionBelief, TheContourSpeaksForAsLongAsItsVerdictLasts) {
  RegionBelief belief(options());
  // It is drawn from a window of frames already: saying it again adds nothing.
  for (std::size_t frame = 0; frame < 3; ++frame) {
    EXPECT_NEAR(belief.update(kSomeone, frame, "person", {.contour = MotionState::kMoving}), 3.5, 1e-12);
  }
  EXPECT_NEAR(belief.update(kSomeone, 3, "person", {.contour = MotionState::kStill}), -1.5, 1e-12);
  EXPECT_NEAR(belief.update(kSomeone, 4, "person", {.contour = MotionState::kCandidate}), 1.0, 1e-12);
}

TEST(RegionBelief, ContourAndPointsAddUp) {
  RegionBelief belief(options());
  RegionEvidence seen = points(9, 9);
  seen.contour = MotionState::kStill;
  EXPECT_NEAR(belief.update(kSomeone, 0, "person", seen), 1.0 + 2.0 - 2.5, 1e-12);
}

TEST(RegionBelief, KeepsRegionsApart) {
  RegionBelief belief(options());
  (void)belief.update(InstanceId{0}, 0, "person", points(9, 9));
  (void)belief.update(InstanceId{1}, 0, "person", points(9, 0));
  EXPECT_NEAR(belief.of(InstanceId{0}, "person"), 3.0, 1e-12);
  EXPECT_NEAR(belief.of(InstanceId{1}, "person"), -1.0, 1e-12);
  EXPECT_EQ(belief.of(InstanceId{2}, "person"), 1.0);
}

TEST(RegionBelief, ForgetsWhomItHasNotSeenSince) {
  RegionBelief belief(options());
  (void)belief.update(InstanceId{0}, 9, "person", points(9, 9));
  (void)belief.update(InstanceId{1}, 10, "person", points(9, 9));
  (void)belief.update(InstanceId{2}, 3, "person", points(9, 9));
  (void)belief.update(InstanceId{2}, 11, "person", {});
  belief.forget_before(10);
  EXPECT_EQ(belief.of(InstanceId{0}, "person"), 1.0) << "the prior";
  EXPECT_NEAR(belief.of(InstanceId{1}, "person"), 3.0, 1e-12);
  EXPECT_NEAR(belief.of(InstanceId{2}, "person"), 2.6, 1e-12) << "seen again later";
  // Who comes back starts anew.
  EXPECT_NEAR(belief.update(InstanceId{0}, 12, "person", {}), 1.0, 1e-12);
}

TEST(RegionBelief, APersonWhoKeepsStillIsSoonBelievedTo) {
  RegionBelief belief(options());
  EXPECT_GT(belief.of(kSomeone, "person"), 0.0) << "people move, until they are seen not to";
  // One point in ten is a mismatch.
  for (std::size_t frame = 0; frame < 30; ++frame) {
    EXPECT_LT(belief.update(kSomeone, frame, "person", points(10, 1)), 0.0) << "frame " << frame;
  }
}

TEST(RegionBelief, AStillPersonWhoStartsToMoveIsDynamicWithinAFewFrames) {
  RegionBelief belief(options());
  for (std::size_t frame = 0; frame < 30; ++frame) {
    (void)belief.update(kSomeone, frame, "person", points(10, 0));
  }
  EXPECT_NEAR(belief.of(kSomeone, "person"), 1.0 - 3.0, 1e-12);
  // An arm first: 3 of 10 points say 3 * 1.609 - 7 * 0.588 = 0.713 a frame. Counted: -1.687, -0.636.
  const double arm = 3.0 * kMoved + 7.0 * kStill;
  EXPECT_NEAR(belief.update(kSomeone, 30, "person", points(10, 3)), 1.0 - 2.4 + arm, 1e-12);
  EXPECT_LT(belief.of(kSomeone, "person"), 0.0);
  EXPECT_NEAR(belief.update(kSomeone, 31, "person", points(10, 3)), 1.0 + 0.8 * (arm - 2.4) + arm, 1e-12);
  EXPECT_GT(belief.of(kSomeone, "person"), 0.0);
}

TEST(RegionBelief, ABedNeedsMoreThanOneSign) {
  RegionBelief belief(options());
  EXPECT_LT(belief.update(InstanceId{0}, 0, "bed", points(9, 9)), 0.0);
  EXPECT_LT(belief.update(InstanceId{1}, 0, "bed", {.contour = MotionState::kMoving}), 0.0);
  RegionEvidence both = points(9, 9);
  both.contour = MotionState::kMoving;
  EXPECT_GT(belief.update(InstanceId{2}, 0, "bed", both), 0.0);
  EXPECT_GT(belief.update(InstanceId{0}, 1, "bed", points(9, 9)), 0.0) << "seen to move twice";
}

TEST(RegionBelief, AChairIsNotTakenForAMoverForOneWrongMatch) {
  RegionBelief belief(options());
  EXPECT_LT(belief.update(InstanceId{0}, 0, "chair", points(3, 1)), 0.0);
  // Nor by a single point, after it was seen to stand.
  for (std::size_t frame = 0; frame < 5; ++frame) {
    (void)belief.update(InstanceId{1}, frame, "chair", points(9, 0));
  }
  EXPECT_LT(belief.update(InstanceId{1}, 5, "chair", points(1, 1)), 0.0);
}

}  // namespace
}  // namespace ipl_slam
