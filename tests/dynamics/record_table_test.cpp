#include "dynamics/record_table.hpp"

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

constexpr InstanceId kWalker{3};

TEST(RecordTable, KnowsAMoverUntilItWasStillForAWholeWindow) {
  RecordTable table(20, 300);
  table.add(kWalker, 100);
  table.check(kWalker, 100, 110, true);
  EXPECT_TRUE(table.contains(kWalker));
  table.check(kWalker, 110, 119, true);
  EXPECT_TRUE(table.contains(kWalker)) << "19 frames are no window";
  table.check(kWalker, 110, 120, true);
  EXPECT_FALSE(table.contains(kWalker));
}

TEST(RecordTable, StartsToCountAnewAfterAMotion) {
  RecordTable table(20, 300);
  table.add(kWalker, 100);
  table.check(kWalker, 100, 110, true);
  table.check(kWalker, 110, 120, false);
  table.check(kWalker, 120, 130, true);
  EXPECT_TRUE(table.contains(kWalker));
  table.check(kWalker, 130, 140, true);
  EXPECT_FALSE(table.contains(kWalker));
}

// Nobody knows what it did between frames 110 and 150.
TEST(RecordTable, DoesNotCountAnAbsenceAsStillness) {
  RecordTable table(20, 300);
  table.add(kWalker, 100);
  table.check(kWalker, 100, 110, true);
  table.check(kWalker, 150, 160, true);
  EXPECT_TRUE(table.contains(kWalker));
  table.check(kWalker, 160, 170, true);
  EXPECT_FALSE(table.contains(kWalker));
}

TEST(RecordTable, ForgetsWhomItHasNotSeenForLong) {
  RecordTable table(20, 300);
  constexpr InstanceId kGone{4};
  table.add(kWalker, 0);
  table.add(kGone, 0);
  table.saw(kWalker, 100);
  table.forget_unseen(300);
  EXPECT_TRUE(table.contains(kGone));
  table.forget_unseen(301);
  EXPECT_FALSE(table.contains(kGone));
  EXPECT_TRUE(table.contains(kWalker));
  table.saw(InstanceId{77}, 301);
  EXPECT_FALSE(table.contains(InstanceId{77})) << "to be seen is not to move";
}

}  // namespace
}  // namespace ipl_slam
