#include "pipeline/dense_views.hpp"

#include <gtest/gtest.h>

#include "support/bare_frame.hpp"
#include "support/synthetic_world.hpp"

namespace ipl_slam {
namespace {

using namespace test;

// Five keyframes in a row; 1 and 3 hang on others after they were taken out.
struct Row {
  Row() {
    for (int i = 0; i < 5; ++i) {
      ids.push_back(map.add_keyframe(bare_frame(20), camera_at({0.1 * i, 0.0, 0.0})));
      views.add(ids.back(), {.frame_index = static_cast<std::size_t>(10 * i)});
    }
  }
  Map map{kTestPyramid};
  std::vector<KeyframeId> ids;
  DenseViews views;
};

TEST(DenseViews, OfKeyframesThatWereTakenOutStayWhereTheyWere) {
  Row row;
  const SE3 before = row.map.pose_of(row.ids[1]);
  row.map.remove_keyframe(row.ids[1]);
  const ViewAnchor anchor = anchor_of(row.map, row.ids[1]);
  EXPECT_NE(anchor.reference, row.ids[1]);
  EXPECT_LT((pose_of(row.map, anchor) * before.inverse()).log().norm(), 1e-12);
}

TEST(DenseViews, FollowTheKeyframeTheyHangOn) {
  Row row;
  row.map.remove_keyframe(row.ids[1]);
  const KeyframeId reference = anchor_of(row.map, row.ids[1]).reference;
  const SE3 before = row.map.pose_of(row.ids[1]);
  Vector6d twist = Vector6d::Zero();
  twist[2] = 0.2;
  const SE3 T = row.map.keyframes()[reference].T_cw * SE3::exp(twist);
  row.map.set_pose(reference, T);
  const auto situations = row.views.in_part(row.map, PartId{0}, nullptr);
  EXPECT_NEAR((situations.at(row.ids[1]).T_cw * before.inverse()).log().norm(), 0.2, 1e-9);
}

TEST(DenseViews, AreThoseOfOnePart) {
  Row row;
  const PartId second = row.map.new_part();
  const KeyframeId other =
      row.map.add_keyframe(bare_frame(20), camera_at({9.0, 0.0, 0.0}), nullptr, {}, {}, second);
  row.views.add(other, {.frame_index = 99});
  row.views.add(KeyframeId{17}, {.frame_index = 120});  // not in the map yet
  EXPECT_EQ(row.views.in_part(row.map, PartId{0}, nullptr).size(), 5U);
  EXPECT_EQ(row.views.in_part(row.map, second, nullptr).size(), 1U);
  EXPECT_EQ(row.views.main_part(row.map), PartId{0});
}

TEST(DenseViews, LeaveAThingOutWhereItMovesAndSomethingUnnamedEverywhere) {
  const InstanceId chair{1}, thing{2};
  DenseViews views;
  views.add(KeyframeId{0}, {.frame_index = 0, .classed = {chair}, .unclassed = {thing}});
  views.add(KeyframeId{1},
            {.frame_index = 10, .classed = {chair}, .unclassed = {thing}, .dynamic = {chair, thing}});
  EXPECT_EQ(views.moved_in(KeyframeId{0}, nullptr), (std::set<InstanceId>{thing}));
  EXPECT_EQ(views.moved_in(KeyframeId{1}, nullptr), (std::set<InstanceId>{chair, thing}));
}

TEST(DenseViews, HearsAfterwardsWhoMoved) {
  const InstanceId chair{1}, thing{2};
  DenseViews views;
  views.add(KeyframeId{0}, {.frame_index = 0, .classed = {chair}, .unclassed = {thing}});
  views.add(KeyframeId{1}, {.frame_index = 30, .classed = {chair}, .unclassed = {}});
  DynamicSpans spans;
  spans.add({chair, 25, 40});
  spans.add({thing, 90, 99});
  EXPECT_EQ(views.moved_in(KeyframeId{0}, &spans), (std::set<InstanceId>{thing}));
  EXPECT_EQ(views.moved_in(KeyframeId{1}, &spans), (std::set<InstanceId>{chair}));
}

}  // namespace
}  // namespace ipl_slam
