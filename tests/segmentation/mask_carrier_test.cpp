#include "segmentation/mask_carrier.hpp"

#include <stdexcept>

#include <gtest/gtest.h>

#include "segmentation/drawn_scene.hpp"

namespace ipl_slam {
namespace {

using test::draw;
using test::DrawnFrame;
using test::Figure;

CarriedMask carry_first(const DrawnFrame& from, const DrawnFrame& to, const std::optional<SE3>& T_w_from = {},
                        const std::optional<SE3>& T_w_to = {}) {
  const MaskCarrier carrier(test::drawn_camera());
  return carrier
      .carry(carrier.view(from.rgbd, T_w_from), {&from.instances[0].mask}, carrier.view(to.rgbd, T_w_to))
      .front();
}

// 0.9 leaves a ring of a bit over one pixel around an ellipse of 56 x 140.
constexpr double kGood = 0.9;

TEST(MaskCarrier, FollowsWhoWalks) {
  const DrawnFrame from = draw(0, {{.centre = {100, 120}}}), to = draw(1, {{.centre = {112, 123}}});
  const CarriedMask carried = carry_first(from, to);
  EXPECT_TRUE(carried.followed);
  EXPECT_GT(iou(carried.mask, to.instances[0].mask), kGood);
  EXPECT_LT(iou(from.instances[0].mask, to.instances[0].mask), 0.7) << "staying would do as well";
}

TEST(MaskCarrier, FollowsAJumpOfMoreThanTheWidth) {
  const DrawnFrame from = draw(0, {{.centre = {100, 120}}}), to = draw(1, {{.centre = {164, 120}}});
  EXPECT_GT(iou(carry_first(from, to).mask, to.instances[0].mask), kGood);
}

TEST(MaskCarrier, DoesNotTakeAPanForAMotionOfItsOwn) {
  const DrawnFrame from = draw(0, {{.centre = {160, 120}}}, 0), to = draw(1, {{.centre = {160, 120}}}, 20);
  EXPECT_GT(iou(carry_first(from, to).mask, to.instances[0].mask), kGood) << "the figure stayed in the image";
  const DrawnFrame both = draw(1, {{.centre = {140, 120}}}, 20);
  EXPECT_GT(iou(carry_first(from, both).mask, both.instances[0].mask), kGood)
      << "the figure went with the wall";
}

TEST(MaskCarrier, FollowsWhoComesNearer) {
  const DrawnFrame from = draw(0, {{.centre = {160, 120}, .depth = 2.0}});
  DrawnFrame to = draw(1, {{.centre = {160, 120}, .depth = 1.8}});
  EXPECT_GT(iou(carry_first(from, to).mask, to.instances[0].mask), kGood);
}

TEST(MaskCarrier, LeavesOutWhoStepsBefore) {
  const Figure still{.centre = {160, 120}, .depth = 2.5, .seed = 1};
  const DrawnFrame from = draw(0, {still});
  const DrawnFrame to = draw(1, {still, {.centre = {190, 120}, .depth = 1.2, .seed = 2}});
  const CarriedMask carried = carry_first(from, to);
  EXPECT_GT(iou(carried.mask, to.instances[0].mask), kGood);
  EXPECT_LT(intersection_area(carried.mask, to.instances[1].mask), to.instances[1].mask.area() / 50);
}

TEST(MaskCarrier, GrowsIntoWhatComesIntoTheImage) {
  const DrawnFrame from = draw(0, {{.centre = {0, 120}}}), to = draw(1, {{.centre = {12, 120}}});
  EXPECT_GT(iou(carry_first(from, to).mask, to.instances[0].mask), kGood);
}

// What lies beside the instance at its depth lay there before: it is no part that came into view.
TEST(MaskCarrier, DoesNotGrowIntoANeighbour) {
  const Figure neighbour{.centre = {150, 120}, .depth = 2.0, .seed = 5, .half = {30, 70}};
  DrawnFrame from = draw(0, {{.centre = {100, 120}, .half = {30, 70}}, neighbour});
  const CarriedMask carried = carry_first(from, from);
  EXPECT_GT(iou(carried.mask, from.instances[0].mask), 0.99);
}

TEST(MaskCarrier, HasNoSupportWhereTheInstanceIsGone) {
  const DrawnFrame from = draw(0, {{.centre = {160, 120}}}), to = draw(1, std::vector<Figure>{});
  const CarriedMask carried = carry_first(from, to);
  EXPECT_LT(carried.depth_fit, 0.1);
  EXPECT_LT(carried.mask.area(), from.instances[0].mask.area() / 10);
}

// Without texture there is no flow; camera motion and depth remain.
TEST(MaskCarrier, MovesWithTheCameraWhereNothingCanBeFollowed) {
  DrawnFrame from = draw(0, {{.centre = {160, 120}}}), to = draw(1, {{.centre = {180, 120}}});
  from.rgbd.color.setTo(128);
  to.rgbd.color.setTo(128);
  // 20 pixels at 2 m.
  const SE3 T_to_from(Eigen::Quaterniond::Identity(), {20.0 * 2.0 / test::drawn_camera().fx, 0.0, 0.0});
  const CarriedMask carried = carry_first(from, to, T_to_from, SE3());
  EXPECT_FALSE(carried.followed);
  EXPECT_GT(iou(carried.mask, to.instances[0].mask), kGood);
}

TEST(MaskCarrier, ADepthlessImageStillCarries) {
  DrawnFrame from = draw(0, {{.centre = {100, 120}}}), to = draw(1, {{.centre = {112, 123}}});
  from.rgbd.depth.setTo(0);
  to.rgbd.depth.setTo(0);
  EXPECT_GT(iou(carry_first(from, to).mask, to.instances[0].mask), kGood);
}

TEST(MaskCarrier, AnEmptyMaskStaysEmpty) {
  const MaskCarrier carrier(test::drawn_camera());
  const CarryView view = carrier.view(draw(0, std::vector<Figure>{}).rgbd);
  const BitMask nothing(cv::Size(320, 240));
  EXPECT_TRUE(carrier.carry(view, {&nothing}, view).front().mask.none());
}

// The flow's pyramid then has fewer levels, down to one.
TEST(MaskCarrier, TakesSmallImagesAndLargeWindows) {
  for (const cv::Size size : {cv::Size(160, 80), cv::Size(64, 48), cv::Size(17, 33), cv::Size(16, 16)}) {
    for (const int window : {5, 11, 31}) {
      Camera camera = test::drawn_camera();
      camera.width = size.width;
      camera.height = size.height;
      MaskCarrierOptions options;
      options.window = window;
      const MaskCarrier carrier(camera, options);
      // A part of a large picture.
      DrawnFrame from = draw(0, {{.centre = {160, 120}}}), to = draw(1, {{.centre = {162, 120}}});
      const cv::Rect part(cv::Point(160 - size.width / 4, 120 - size.height / 2), size);
      for (DrawnFrame* frame : {&from, &to}) {
        frame->rgbd.color = frame->rgbd.color(part).clone();
        frame->rgbd.depth = frame->rgbd.depth(part).clone();
      }
      const BitMask before = BitMask::from_image(from.instances[0].mask.to_image()(part).clone());
      const BitMask after = BitMask::from_image(to.instances[0].mask.to_image()(part).clone());
      const CarriedMask carried =
          carrier.carry(carrier.view(from.rgbd), {&before}, carrier.view(to.rgbd)).front();
      EXPECT_GT(iou(carried.mask, after), 0.8) << size << ", window " << window;
    }
  }
}

TEST(MaskCarrier, RefusesAFrameOfAnotherSize) {
  RgbdFrame frame = draw(0, std::vector<Figure>{}).rgbd;
  frame.depth = frame.depth(cv::Rect(0, 0, 100, 100));
  EXPECT_THROW((void)MaskCarrier(test::drawn_camera()).view(frame), std::invalid_argument);
}

}  // namespace
}  // namespace ipl_slam
