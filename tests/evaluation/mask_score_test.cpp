#include "evaluation/mask_score.hpp"

#include <stdexcept>

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

BitMask strip(int first, int last) {
  BitMask mask(cv::Size(100, 2));
  mask.set_run(0, first, last);
  return mask;
}

TEST(MaskScore, CountsPixels) {
  MaskScore score;
  score.add(strip(10, 40), strip(20, 60));  // 20 in common, 10 too many, 20 missing
  EXPECT_DOUBLE_EQ(score.recall(), 20.0 / 40.0);
  EXPECT_DOUBLE_EQ(score.precision(), 20.0 / 30.0);
  EXPECT_DOUBLE_EQ(score.false_area(), 10.0 / 200.0);
}

TEST(MaskScore, AddsUpPixelsNotShares) {
  MaskScore score, other;
  score.add(strip(0, 10), strip(0, 10));
  other.add(strip(0, 0), strip(0, 30));
  score += other;
  EXPECT_DOUBLE_EQ(score.recall(), 10.0 / 40.0);
  EXPECT_DOUBLE_EQ(score.precision(), 1.0);
  EXPECT_DOUBLE_EQ(score.false_area(), 0.0);
}

TEST(MaskScore, WithNothingToFindNothingIsMissed) {
  EXPECT_DOUBLE_EQ(MaskScore().recall(), 1.0);
  EXPECT_DOUBLE_EQ(MaskScore().precision(), 1.0);
  EXPECT_DOUBLE_EQ(MaskScore().false_area(), 0.0);
}

TEST(MaskScore, RefusesMasksOfDifferentSizes) {
  MaskScore score;
  EXPECT_THROW(score.add(strip(0, 1), BitMask(cv::Size(99, 2))), std::invalid_argument);
}

}  // namespace
}  // namespace ipl_slam
