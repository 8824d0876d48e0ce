#include "dynamics/feature_weights.hpp"

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

// 4 x 3 pixels of which two opposite corners are on.
BitMask corners() {
  BitMask mask(cv::Size(4, 3));
  mask.set(0, 0);
  mask.set(3, 2);
  return mask;
}

// A row of 16 pixels of which the left half is on.
BitMask half_row() {
  BitMask mask(cv::Size(16, 1));
  mask.set_run(0, 0, 8);
  return mask;
}

TEST(Covers, AsksTheNearestPixel) {
  const BitMask mask = corners();
  EXPECT_TRUE(covers(mask, {0.0, 0.0}));
  EXPECT_TRUE(covers(mask, {0.4, 0.4}));
  EXPECT_FALSE(covers(mask, {0.6, 0.0}));
  EXPECT_FALSE(covers(mask, {0.0, 0.6}));
  EXPECT_TRUE(covers(mask, {2.6, 1.6}));
  EXPECT_TRUE(covers(mask, {3.4, 2.4}));
}

TEST(Covers, NothingOutsideTheMask) {
  const BitMask mask = corners();
  EXPECT_TRUE(covers(mask, {-0.4, -0.4})) << "still nearest to the corner";
  EXPECT_FALSE(covers(mask, {-0.6, 0.0}));
  EXPECT_FALSE(covers(mask, {0.0, -0.6}));
  EXPECT_FALSE(covers(mask, {3.6, 2.0}));
  EXPECT_FALSE(covers(mask, {3.0, 2.6}));
  EXPECT_FALSE(covers(mask, {1e6, -1e6}));
  EXPECT_FALSE(covers(BitMask(), {0.0, 0.0}));
}

TEST(ShareInside, IsThatOfTheLength) {
  EXPECT_EQ(share_inside(half_row(), {-0.5, 0.0}, {15.5, 0.0}), 0.5);
  EXPECT_EQ(share_inside(half_row(), {15.5, 0.0}, {-0.5, 0.0}), 0.5) << "either way";
  EXPECT_EQ(share_inside(half_row(), {0.0, 0.0}, {7.0, 0.0}), 1.0);
  EXPECT_EQ(share_inside(half_row(), {8.0, 0.0}, {15.0, 0.0}), 0.0);
}

TEST(ShareInside, WhatLiesOutsideTheImageIsNotInside) {
  // 16 pixels before the image, 8 in the mask, 8 beside it.
  EXPECT_EQ(share_inside(half_row(), {-16.5, 0.0}, {15.5, 0.0}), 0.25);
  EXPECT_EQ(share_inside(half_row(), {0.0, 5.0}, {7.0, 5.0}), 0.0);
}

TEST(ShareInside, BearsWaysWithoutLengthAndEmptyMasks) {
  EXPECT_EQ(share_inside(half_row(), {3.0, 0.0}, {3.0, 0.0}), 1.0);
  EXPECT_EQ(share_inside(half_row(), {9.0, 0.0}, {9.0, 0.0}), 0.0);
  EXPECT_EQ(share_inside(BitMask(), {0.0, 0.0}, {7.0, 0.0}), 0.0);
  EXPECT_EQ(share_inside(BitMask(cv::Size(16, 1)), {0.0, 0.0}, {7.0, 0.0}), 0.0);
}

TEST(FeatureWeights, CountEverythingFullyUnlessTold) {
  const FeatureWeights weights;
  EXPECT_EQ(weights.point(17), 1.0);
  EXPECT_FALSE(weights.in_dynamic({0.0, 0.0}));
  EXPECT_EQ(weights.dynamic_share({0.0, 0.0}, {9.0, 9.0}), 0.0);
  const FeatureTrust trust;
  EXPECT_EQ(trust.weight(17), 1.0);
  EXPECT_FALSE(trust.region(17).valid());
}

TEST(FeatureWeights, AreThoseOfTheFeature) {
  FeatureWeights weights;
  weights.points = {0.25, 0.0};
  weights.dynamic = half_row();
  EXPECT_EQ(weights.point(0), 0.25);
  EXPECT_EQ(weights.point(1), 0.0);
  EXPECT_TRUE(weights.in_dynamic({7.0, 0.0}));
  EXPECT_FALSE(weights.in_dynamic({8.0, 0.0}));
  EXPECT_EQ(weights.dynamic_share({-0.5, 0.0}, {15.5, 0.0}), 0.5);
  const FeatureTrust trust{{0.5, 0.0}, {InstanceId{}, InstanceId{4}}};
  EXPECT_EQ(trust.weight(0), 0.5);
  EXPECT_FALSE(trust.region(0).valid());
  EXPECT_EQ(trust.region(1), InstanceId{4});
}

}  // namespace
}  // namespace ipl_slam
