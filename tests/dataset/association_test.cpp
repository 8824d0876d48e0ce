#include "dataset/association.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

using ::testing::ElementsAre;
using ::testing::Pair;

using Stamps = std::vector<double>;

TEST(Association, PairsTheClosestStamps) {
  EXPECT_THAT(associate(Stamps{1.000, 1.033, 1.066}, Stamps{1.005, 1.030, 1.070}),
              ElementsAre(Pair(0, 0), Pair(1, 1), Pair(2, 2)));
}

// In order of time 1.00 would take 1.01 and leave nothing for 1.012, which is closer to it.
TEST(Association, LetsTheBestPairChooseFirst) {
  EXPECT_THAT(associate(Stamps{1.000, 1.012}, Stamps{1.010}), ElementsAre(Pair(1, 0)));
}

// 1.010 goes to 1.012; 1.000 is left with 0.985, its second choice, still inside the window.
TEST(Association, GivesTheSecondChoiceToWhoLostTheFirst) {
  EXPECT_THAT(associate(Stamps{1.000, 1.012}, Stamps{0.985, 1.010}), ElementsAre(Pair(0, 0), Pair(1, 1)));
}

// Stamps that are exact in binary, so that the differences are equal to the last bit.
TEST(Association, OfEquallyClosePairsTakesTheEarlier) {
  EXPECT_THAT(associate(Stamps{1.0}, Stamps{0.9921875, 1.0078125}), ElementsAre(Pair(0, 0)));
  EXPECT_THAT(associate(Stamps{0.9921875, 1.0078125}, Stamps{1.0}), ElementsAre(Pair(0, 0)));
}

TEST(Association, LeavesOutAGapInOneList) {
  EXPECT_THAT(associate(Stamps{1.0, 2.0, 3.0, 4.0}, Stamps{1.001, 3.999}),
              ElementsAre(Pair(0, 0), Pair(3, 1)));
}

// The benchmark's script compares with "<"; 0.015625 is exact in binary.
TEST(Association, LeavesOutADifferenceAsLargeAsTheWindow) {
  EXPECT_TRUE(associate(Stamps{1.0}, Stamps{1.015625}, 0.015625).empty());
  EXPECT_EQ(associate(Stamps{1.0}, Stamps{1.015625}, 0.0157).size(), 1u);
}

TEST(Association, OfNothingIsNothing) {
  EXPECT_TRUE(associate(Stamps{}, Stamps{1.0}).empty());
  EXPECT_TRUE(associate(Stamps{1.0}, Stamps{}).empty());
}

}  // namespace
}  // namespace ipl_slam
