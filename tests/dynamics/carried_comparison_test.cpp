#include "dynamics/carried_comparison.hpp"

#include <gtest/gtest.h>

#include "dynamics/billboards.hpp"
#include "dynamics/shape_similarity.hpp"

namespace ipl_slam {
namespace {

using test::Billboard;
using test::BillboardView;
using test::camera_pose;
using test::kBillboardCamera;
using test::look_at_billboards;

// A board of 0.6 x 1 m at 3 m is 52 x 87 pixels: a line of pixels along its outline is 6 % of its area.
// Carried points fall on either side of the outline where they are rounded to pixels, hence this for "the
// same".
constexpr double kSame = 0.93;

const Billboard kBoard;

InstanceView view_of(const BillboardView& seen, const std::optional<SE3>& T_wc) {
  return InstanceView(seen.instances, seen.depth, T_wc, kBillboardCamera.depth_scale);
}

InstanceView view_of(const std::vector<Billboard>& boards, const SE3& T_wc,
                     const Camera& camera = kBillboardCamera) {
  return view_of(look_at_billboards(boards, T_wc, camera), T_wc);
}

// IoU of the first boards.
std::optional<double> carried_iou(const InstanceView& earlier, const InstanceView& later,
                                  const CarriedComparisonOptions& options = {},
                                  const Camera& camera = kBillboardCamera) {
  const auto shapes = CarriedComparison(camera, options).compare(earlier, 0, later, 0);
  return shapes ? std::optional(shapes->iou) : std::nullopt;
}

TEST(CarriedComparison, FindsAStillObjectStillHoweverTheCameraMoves) {
  const SE3 start = camera_pose(0.0);
  for (const SE3& end : {camera_pose(0.4), camera_pose(0.0, 0.2), camera_pose(0.0, 0.0, 0.8),
                         camera_pose(0.0, 0.0, -0.5), camera_pose(0.2, -0.1, 0.3, 0.1)}) {
    const InstanceView earlier = view_of({kBoard}, start), later = view_of({kBoard}, end);
    EXPECT_GT(carried_iou(earlier, later), kSame);
    EXPECT_LT(iou(earlier.instances[0].instance.mask, later.instances[0].instance.mask), 0.75)
        << "the camera's motion must matter here";
  }
}

TEST(CarriedComparison, KeepsTheShapeOfAStillObject) {
  const auto shapes =
      CarriedComparison(kBillboardCamera, {})
          .compare(view_of({kBoard}, camera_pose(0.0)), 0, view_of({kBoard}, camera_pose(0.2, 0.0, 0.5)), 0);
  ASSERT_TRUE(shapes);
  EXPECT_GT(hu_similarity(shapes->earlier, shapes->later), 0.9);  // h2, (n20 - n02)^2, feels a row of pixels
}

TEST(CarriedComparison, HoldsForADistortedCamera) {
  Camera camera = kBillboardCamera;
  camera.k1 = 0.26;
  camera.k2 = -0.95;
  camera.p1 = -0.005;
  camera.k3 = 1.16;
  const InstanceView earlier = view_of({kBoard}, camera_pose(-0.9), camera);
  const InstanceView later = view_of({kBoard}, camera_pose(0.9), camera);
  EXPECT_GT(carried_iou(earlier, later, {}, camera), kSame);
}

TEST(CarriedComparison, MeasuresHowFarAnObjectMoved) {
  Billboard moved = kBoard;
  moved.x += 0.5 * kBoard.width;
  const InstanceView earlier = view_of({kBoard}, camera_pose(0.0)),
                     later = view_of({moved}, camera_pose(0.3));
  EXPECT_NEAR(*carried_iou(earlier, later), 0.5 / 1.5, 0.03);
  moved.x += 2.0 * kBoard.width;
  EXPECT_EQ(carried_iou(earlier, view_of({moved}, camera_pose(0.3))), 0.0);
}

TEST(CarriedComparison, TakesComingNearerForMotion) {
  Billboard moved = kBoard;
  moved.z = 2.0;  // 1/2 - 1/3 = 0.17 1/m nearer
  const InstanceView earlier = view_of({kBoard}, camera_pose(0.0)),
                     later = view_of({moved}, camera_pose(0.0));
  EXPECT_EQ(carried_iou(earlier, later), 0.0);
  CarriedComparisonOptions outlines_only;
  outlines_only.surface_agreement = false;
  EXPECT_GT(carried_iou(earlier, later, outlines_only), 0.4);
}

TEST(CarriedComparison, LeavesOutWhatSomebodyNearerCovers) {
  const Billboard passer_by{1, 0.15, 0.0, 1.5, 0.3, 2.0};  // over the right half of the board
  const InstanceView alone = view_of({kBoard}, camera_pose(0.0));
  const InstanceView covered = view_of({kBoard, passer_by}, camera_pose(0.05));
  EXPECT_LT(iou(alone.instances[0].instance.mask, covered.instances[0].instance.mask), 0.7);
  EXPECT_GT(carried_iou(alone, covered), kSame);
  EXPECT_GT(carried_iou(covered, alone), kSame);
}

TEST(CarriedComparison, KnowsOneWhoCoversByTheMaskWhereDepthIsMissing) {
  const Billboard passer_by{1, 0.15, 0.0, 1.5, 0.3, 2.0};
  const InstanceView alone = view_of({kBoard}, camera_pose(0.0));
  BillboardView seen = look_at_billboards({kBoard, passer_by}, camera_pose(0.0));
  cv::Mat shadow = seen.instances[1].instance.mask.to_image();
  shadow.rowRange(100, 110) = 0;  // a few measured rows tell how near he is
  seen.depth.setTo(0, shadow);
  EXPECT_GT(carried_iou(alone, view_of(seen, camera_pose(0.0))), kSame);
}

TEST(CarriedComparison, LeavesOutWhatIsOutOfView) {
  const InstanceView whole = view_of({kBoard}, camera_pose(0.0));
  const InstanceView half = view_of({kBoard}, camera_pose(0.0, 0.0, 0.0, 0.58));
  ASSERT_LT(half.shapes[0].area, 0.7 * whole.shapes[0].area);
  EXPECT_GT(carried_iou(whole, half), kSame);
  EXPECT_GT(carried_iou(half, whole), kSame);
}

TEST(CarriedComparison, FillsMissingDepthWithTheInstancesOwn) {
  BillboardView seen = look_at_billboards({kBoard}, camera_pose(0.0));
  seen.depth.rowRange(0, 119) = 0;  // more than half of the board
  const InstanceView earlier = view_of(seen, camera_pose(0.0));
  EXPECT_GT(carried_iou(earlier, view_of({kBoard}, camera_pose(0.4))), kSame);
}

TEST(CarriedComparison, TakesWhatHasNoDepthAtAllForFar) {
  const Billboard far{0, 0.0, 0.0, 4.9, 1.6, 2.0};
  const auto without_depth = [&far](const SE3& T_wc) {
    BillboardView seen = look_at_billboards({far}, T_wc);
    seen.depth.setTo(0, seen.instances[0].instance.mask.to_image());
    return view_of(seen, T_wc);
  };
  CarriedComparisonOptions options;
  options.unmeasured_depth = 5.0;
  EXPECT_GT(carried_iou(without_depth(camera_pose(0.0)), without_depth(camera_pose(0.5)), options), kSame);
}

TEST(CarriedComparison, GivesTheOutlineLessWeightWhereTheSurfaceStayed) {
  const InstanceView earlier = view_of({kBoard}, camera_pose(0.0));
  BillboardView seen = look_at_billboards({kBoard}, camera_pose(0.0));
  BitMask upper_half(seen.depth.size());
  for (int y = 0; y < 120; ++y) upper_half.set_run(y, 0, 320);
  seen.instances[0].instance.mask -= upper_half;  // the segmenter sees the legs only
  const InstanceView later = view_of(seen, camera_pose(0.0));
  CarriedComparisonOptions options;
  options.outline_weight = 1.0;
  EXPECT_NEAR(*carried_iou(earlier, later, options), 0.5, 0.02);
  options.outline_weight = 0.25;
  EXPECT_NEAR(*carried_iou(earlier, later, options), 0.5 / (0.5 + 0.25 * 0.5), 0.02);
}

TEST(CarriedComparison, SaysNothingWithoutAPoseOrWhereAllIsHidden) {
  const SE3 here = camera_pose(0.0);
  const InstanceView earlier = view_of({kBoard}, here);
  const InstanceView lost = view_of(look_at_billboards({kBoard}, here), std::nullopt);
  EXPECT_FALSE(carried_iou(earlier, lost));
  EXPECT_FALSE(carried_iou(lost, earlier));
  // A sliver of the board is left: what is seen of it is too little to judge by.
  const InstanceView sliver = view_of({kBoard, {1, -0.02, 0.0, 1.5, 0.3, 2.0}}, here);
  ASSERT_GT(sliver.shapes[0].area, 0);
  EXPECT_FALSE(carried_iou(earlier, sliver));
}

// The cost is bounded, and what is measured changes by the noise of sampling only.
TEST(CarriedComparison, NeedsFewSamples) {
  Billboard moved = kBoard;
  moved.x += 0.2;
  const InstanceView earlier = view_of({kBoard}, camera_pose(0.0)),
                     later = view_of({moved}, camera_pose(0.1));
  CarriedComparisonOptions few, all;
  few.samples = 300;
  all.samples = 1000000;
  EXPECT_NEAR(*carried_iou(earlier, later, few), *carried_iou(earlier, later, all), 0.05);
}

}  // namespace
}  // namespace ipl_slam
