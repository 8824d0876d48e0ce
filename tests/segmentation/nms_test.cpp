#include "segmentation/nms.hpp"

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

Detection box(float x0, float y0, float x1, float y1, float score, int class_index = 0, int anchor = 0) {
  return {x0, y0, x1, y1, score, class_index, anchor};
}

TEST(BoxIou, IsCommonAreaByAreaOfBoth) {
  // 10 x 10 boxes, 5 apart: 50 common, 150 together.
  EXPECT_FLOAT_EQ(box_iou(box(0, 0, 10, 10, 1), box(5, 0, 15, 10, 1)), 50.0F / 150.0F);
  EXPECT_FLOAT_EQ(box_iou(box(0, 0, 10, 10, 1), box(0, 0, 10, 10, 1)), 1.0F);
}

TEST(BoxIou, IsZeroForBoxesThatOnlyTouch) {
  EXPECT_EQ(box_iou(box(0, 0, 10, 10, 1), box(10, 0, 20, 10, 1)), 0.0F);
  EXPECT_EQ(box_iou(box(0, 0, 10, 10, 1), box(30, 30, 40, 40, 1)), 0.0F);
}

TEST(SuppressOverlaps, KeepsTheBestOfOverlappingBoxes) {
  const auto kept = suppress_overlaps(
      {box(1, 0, 11, 10, 0.5F), box(0, 0, 10, 10, 0.9F), box(50, 0, 60, 10, 0.6F)}, 0.5F, 10);
  ASSERT_EQ(kept.size(), 2U);
  EXPECT_FLOAT_EQ(kept[0].score, 0.9F);
  EXPECT_FLOAT_EQ(kept[1].score, 0.6F);
}

TEST(SuppressOverlaps, LeavesOverlapsUpToTheLimit) {
  // IoU is 1/3.
  const std::vector<Detection> pair = {box(0, 0, 10, 10, 0.9F), box(5, 0, 15, 10, 0.8F)};
  EXPECT_EQ(suppress_overlaps(pair, 0.34F, 10).size(), 2U);
  EXPECT_EQ(suppress_overlaps(pair, 0.33F, 10).size(), 1U);
}

TEST(SuppressOverlaps, ASuppressedBoxSuppressesNoOther) {
  // The middle one overlaps both its neighbours by more than half of either, which do not overlap each other
  // enough.
  const auto kept = suppress_overlaps(
      {box(0, 0, 10, 10, 0.9F), box(3, 0, 13, 10, 0.8F), box(6, 0, 16, 10, 0.7F)}, 0.5F, 10);
  ASSERT_EQ(kept.size(), 2U);
  EXPECT_FLOAT_EQ(kept[1].score, 0.7F);
}

TEST(SuppressOverlaps, DoesNotMixClasses) {
  EXPECT_EQ(suppress_overlaps({box(0, 0, 10, 10, 0.9F, 0), box(0, 0, 10, 10, 0.8F, 1)}, 0.5F, 10).size(), 2U);
}

TEST(SuppressOverlaps, OrdersEqualScoresByAnchorWhateverTheOrderTheyCameIn) {
  const Detection first = box(0, 0, 10, 10, 0.9F, 0, 3), second = box(20, 0, 30, 10, 0.9F, 0, 7);
  for (const auto& boxes : {std::vector{first, second}, std::vector{second, first}}) {
    const auto kept = suppress_overlaps(boxes, 0.5F, 10);
    ASSERT_EQ(kept.size(), 2U);
    EXPECT_EQ(kept[0].anchor, 3);
    EXPECT_EQ(kept[1].anchor, 7);
  }
}

TEST(SuppressOverlaps, KeepsTheBestWhenThereAreTooMany) {
  const auto kept =
      suppress_overlaps({box(0, 0, 1, 1, 0.1F), box(2, 0, 3, 1, 0.9F), box(4, 0, 5, 1, 0.5F)}, 0.5F, 2);
  ASSERT_EQ(kept.size(), 2U);
  EXPECT_FLOAT_EQ(kept[0].score, 0.9F);
  EXPECT_FLOAT_EQ(kept[1].score, 0.5F);
}

}  // namespace
}  // namespace ipl_slam
