// Parts of a map: what is mapped after tracking broke off, until a known place joins them.

#include <gtest/gtest.h>

#include "map/map.hpp"
#include "support/bare_frame.hpp"
#include "support/map_checks.hpp"
#include "support/synthetic_world.hpp"

namespace ipl_slam {
namespace {

using namespace test;

// What changes of world frame leave of a double, some metres from the origin.
constexpr double kRounding = 1e-9;

std::shared_ptr<const LineFeatures> two_segments() {
  LineFeatures lines;
  lines.segments.resize(2);
  lines.descriptors.resize(2);
  return std::make_shared<const LineFeatures>(std::move(lines));
}

// Three keyframes in each of two parts; those of one part share points and a line.
struct TwoParts {
  TwoParts() {
    for (const PartId part : {first, second}) {
      for (int i = 0; i < 3; ++i) {
        keyframes.push_back(map.add_keyframe(bare_frame(8), camera_at({1.0 * i, 0.0, 0.2 * part.value}),
                                             two_segments(), {}, {}, part));
      }
    }
    for (std::size_t at : {0U, 3U}) {
      for (std::uint32_t k = 0; k < 4; ++k) {
        points.push_back(map.add_point({0.3 * k, 0.1, 2.0}, keyframes[at], k));
        map.add_observation(points.back(), keyframes[at + 1], k);
        map.refresh(points.back());
      }
      const Eigen::Vector3d start(-0.5, 0.2, 2.0), end(0.5, 0.1, 2.5);
      lines.push_back(map.add_line(*Line3::through(start, end), start, end, keyframes[at], 0));
      map.add_observation(lines.back(), keyframes[at + 1], 0);
    }
  }
  static constexpr PartId first{0}, second{1};
  Map map{kTestPyramid};
  std::vector<KeyframeId> keyframes;
  std::vector<PointId> points;
  std::vector<LineId> lines;
};

const SE3 kMove = SE3::exp((Vector6d() << 0.8, -0.4, 0.9, 0.1, 0.5, -0.2).finished());

TEST(MapParts, AMapThatIsNeverBrokenOffHasOne) {
  Map map(kTestPyramid);
  EXPECT_TRUE(map.parts().empty());
  EXPECT_EQ(map.new_part(), PartId{0});
  const KeyframeId oldest = map.add_keyframe(bare_frame(2), SE3{});
  const KeyframeId next = map.add_keyframe(bare_frame(2), SE3{});
  EXPECT_EQ(map.parts(), std::vector{PartId{0}});
  EXPECT_EQ(map.anchor(PartId{0}), oldest);
  EXPECT_TRUE(map.is_anchor(oldest));
  EXPECT_FALSE(map.is_anchor(next));
  EXPECT_EQ(map.new_part(), PartId{1});
}

TEST(MapParts, EachHangsOnItsOldestKeyframe) {
  const TwoParts made;
  EXPECT_EQ(made.map.parts(), (std::vector{made.first, made.second}));
  EXPECT_EQ(made.map.anchor(made.first), made.keyframes[0]);
  EXPECT_EQ(made.map.anchor(made.second), made.keyframes[3]);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(made.map.part_of(made.keyframes[i]), i < 3 ? made.first : made.second);
    EXPECT_EQ(made.map.is_anchor(made.keyframes[i]), i % 3 == 0);
  }
}

TEST(MapParts, MergingMovesPosesPointsAndLinesOfTheYoungerOne) {
  TwoParts made;
  const Map before = made.map;
  made.map.merge_parts(made.first, made.second, kMove);
  expect_consistent(made.map);
  EXPECT_EQ(made.map.parts(), std::vector{made.first});
  EXPECT_FALSE(made.map.anchor(made.second).valid());
  EXPECT_FALSE(made.map.is_anchor(made.keyframes[3])) << "there is one anchor per part";
  EXPECT_EQ(made.map.new_part(), PartId{2}) << "the number of a part that is gone is not used again";
  for (std::size_t i = 0; i < 6; ++i) {
    const KeyframeId id = made.keyframes[i];
    EXPECT_EQ(made.map.part_of(id), made.first);
    const SE3 T_cw = before.pose_of(id);
    EXPECT_LT(pose_difference(made.map.pose_of(id), i < 3 ? T_cw : T_cw * kMove.inverse()), kRounding);
  }
  const auto moved = [&](std::size_t i, const Eigen::Vector3d& p, std::size_t of_first) {
    return i < of_first ? p : kMove * p;
  };
  for (std::size_t i = 0; i < made.points.size(); ++i) {
    const Eigen::Vector3d wanted = moved(i, before.points()[made.points[i]].position, 4);
    EXPECT_LT((made.map.points()[made.points[i]].position - wanted).norm(), kRounding);
  }
  for (std::size_t i = 0; i < made.lines.size(); ++i) {
    const Line &was = before.lines()[made.lines[i]], &is = made.map.lines()[made.lines[i]];
    EXPECT_LT((is.start - moved(i, was.start, 1)).norm(), kRounding);
    EXPECT_LT((is.end - moved(i, was.end, 1)).norm(), kRounding);
    EXPECT_LT(is.line.distance(is.start), kRounding);
    EXPECT_LT(is.line.distance(is.end), kRounding);
  }
}

TEST(MapParts, MergingTurnsTheViewingDirectionsAlong) {
  TwoParts made;
  const Eigen::Vector3d before = made.map.points()[made.points[4]].normal;
  made.map.merge_parts(made.first, made.second, kMove);
  EXPECT_LT((made.map.points()[made.points[4]].normal - kMove.rotation() * before).norm(), kRounding);
}

TEST(MapParts, AKeyframeThatWasTakenOutMovesWithItsPart) {
  TwoParts made;
  const KeyframeId gone = made.keyframes[4];
  const SE3 before = made.map.pose_of(gone);
  made.map.remove_keyframe(gone);
  EXPECT_EQ(made.map.part_of(gone), made.second);
  EXPECT_EQ(made.map.surviving(gone), made.keyframes[3]) << "the one it shared most landmarks with";
  EXPECT_LT(pose_difference(made.map.pose_of(gone), before), kRounding);
  made.map.merge_parts(made.first, made.second, kMove);
  EXPECT_EQ(made.map.part_of(gone), made.first);
  EXPECT_LT(pose_difference(made.map.pose_of(gone), before * kMove.inverse()), kRounding);
}

TEST(MapParts, AKeyframeThatSharesNothingHangsOnTheAnchorOfItsOwnPart) {
  Map map(kTestPyramid);
  for (const PartId part : {PartId{0}, PartId{1}, PartId{1}, PartId{1}}) {
    map.add_keyframe(bare_frame(2), SE3{}, nullptr, {}, {}, part);
  }
  map.remove_keyframe(KeyframeId{2});
  EXPECT_EQ(map.surviving(KeyframeId{2}), KeyframeId{1});
}

TEST(MapParts, WhatSurvivesARowOfRemovalsIsInTheMap) {
  TwoParts made;
  Map& map = made.map;
  map.add_keyframe(bare_frame(8), SE3{}, nullptr, {}, {}, made.second);
  map.remove_keyframe(made.keyframes[5]);
  map.remove_keyframe(made.keyframes[4]);
  for (const std::size_t i : {4U, 5U}) EXPECT_EQ(map.surviving(made.keyframes[i]), made.keyframes[3]);
  EXPECT_EQ(map.surviving(made.keyframes[3]), made.keyframes[3]) << "what is in the map is itself";
}

TEST(MapLoops, OfAKeyframeThatIsTakenOutBecomeItsParents) {
  TwoParts made;
  Map& map = made.map;
  const KeyframeId gone = made.keyframes[1], parent = made.keyframes[0], end = made.keyframes[2];
  const auto relative = [&](KeyframeId a, KeyframeId b) { return map.pose_of(a) * map.pose_of(b).inverse(); };
  // Both ways round: each edge says what the map says.
  map.add_loop({gone, end, relative(gone, end)});
  map.add_loop({end, gone, relative(end, gone)});
  map.remove_keyframe(gone);
  ASSERT_EQ(map.loops().size(), 2U);
  for (const LoopEdge& edge : map.loops()) {
    EXPECT_TRUE((edge.a == parent && edge.b == end) || (edge.a == end && edge.b == parent));
    EXPECT_LT(pose_difference(edge.T_ab, relative(edge.a, edge.b)), kRounding);
  }
}

TEST(MapLoops, BetweenAKeyframeAndItsParentVanishWithIt) {
  TwoParts made;
  made.map.add_loop({made.keyframes[0], made.keyframes[1], SE3{}});
  made.map.remove_keyframe(made.keyframes[1]);
  EXPECT_TRUE(made.map.loops().empty());
}

}  // namespace
}  // namespace ipl_slam
