#include "loop/loop_correction.hpp"

#include <gtest/gtest.h>

#include "loop/drifted_tour.hpp"
#include "support/map_checks.hpp"

namespace ipl_slam {
namespace {

using namespace test;

constexpr std::size_t kCurrent = DriftedTour::kKeyframes - 1, kFound = kCurrent - DriftedTour::kTurn;

void expect_same_pose(const SE3& a, const SE3& b) {
  EXPECT_EQ(a.translation(), b.translation());
  EXPECT_EQ(a.rotation().coeffs(), b.rotation().coeffs());
}

void expect_same_map(const Map& a, const Map& b) {
  ASSERT_EQ(a.points().size(), b.points().size());
  a.keyframes().for_each([&](KeyframeId id, const Keyframe& k) {
    expect_same_pose(k.T_cw, b.keyframes()[id].T_cw);
    EXPECT_EQ(k.points, b.keyframes()[id].points);
  });
  a.points().for_each([&](PointId id, const Point& point) {
    ASSERT_TRUE(b.points().contains(id));
    EXPECT_EQ(point.position, b.points()[id].position);
    EXPECT_EQ(point.normal, b.points()[id].normal);
  });
}

TEST(CloseLoop, TakesTheDriftOut) {
  DriftedTour tour;
  const double before = tour.error(), pixels_before = tour.reprojection_error();
  const CorrectionEffect effect =
      loop_correction().close_loop(tour.map, tour.keyframes[kCurrent], tour.match(kCurrent, kFound));
  EXPECT_TRUE(effect.done);
  EXPECT_GT(before, 0.05);
  EXPECT_LT(tour.error(), before / 3.0);
  // The rest of the loop took a part of the error on each step: a fraction of a pixel.
  EXPECT_LT(tour.reprojection_error(), pixels_before + 0.5);
  expect_consistent(tour.map);
}

TEST(CloseLoop, TheCurrentKeyframeStandsWhereTheMatchSaysAndTheLoopIsRemembered) {
  DriftedTour tour;
  const PlaceMatch match = tour.match(kCurrent, kFound);
  const KeyframeId current = tour.keyframes[kCurrent], found = tour.keyframes[kFound];
  const SE3 drifted = tour.map.keyframes()[current].T_cw, there = tour.map.keyframes()[found].T_cw;
  const SE3 anchor = tour.map.keyframes()[tour.keyframes[0]].T_cw;
  const CorrectionEffect effect = loop_correction().close_loop(tour.map, current, match);
  EXPECT_LT(pose_difference(tour.map.keyframes()[current].T_cw, match.T_cw), 1e-9);
  EXPECT_NEAR(effect.translation, (match.T_cw * drifted.inverse()).translation().norm(), 1e-12);
  expect_same_pose(tour.map.keyframes()[found].T_cw, there);
  expect_same_pose(tour.map.keyframes()[tour.keyframes[0]].T_cw, anchor);
  ASSERT_EQ(tour.map.loops().size(), 1U);
  EXPECT_EQ(tour.map.loops()[0].a, current);
  EXPECT_EQ(tour.map.loops()[0].b, found);
  EXPECT_LT(pose_difference(tour.map.loops()[0].T_ab, match.T_cw * there.inverse()), 1e-9);
}

TEST(CloseLoop, WhatBothSidesSawBecomesOne) {
  DriftedTour tour;
  const PlaceMatch match = tour.match(kCurrent, kFound);
  const CorrectionEffect effect = loop_correction().close_loop(tour.map, tour.keyframes[kCurrent], match);
  std::size_t shown_twice = 0, united = 0;
  for (const std::size_t i : {kCurrent, kCurrent - 1}) {
    for (std::uint32_t k = 0; k < tour.views[i].sources.size(); ++k) {
      const int there = tour.views[i - DriftedTour::kTurn].keypoint_of(tour.views[i].sources[k]);
      if (there < 0) continue;
      const PointId a = tour.map.keyframes()[tour.keyframes[i]].points[k];
      const PointId b = tour.map.keyframes()[tour.keyframes[i - DriftedTour::kTurn]]
                            .points[static_cast<std::size_t>(there)];
      ++shown_twice;
      united += a.valid() && a == b ? 1 : 0;
    }
  }
  ASSERT_GT(shown_twice, 200U);
  EXPECT_GT(united, shown_twice * 9 / 10) << "but for some that noise keeps out";
  EXPECT_GT(effect.points, 100U);
  EXPECT_GT(effect.here, 2U);
  EXPECT_GT(effect.there, 2U);
}

TEST(CloseLoop, WhereTheAnchorLiesAroundTheCurrentKeyframeTheOtherSideMoves) {
  DriftedTour tour;
  const double before = tour.error();
  const SE3 anchor = tour.map.keyframes()[tour.keyframes[0]].T_cw;
  loop_correction().close_loop(tour.map, tour.keyframes[kFound], tour.match(kFound, kCurrent));
  expect_same_pose(tour.map.keyframes()[tour.keyframes[0]].T_cw, anchor);
  EXPECT_LT(tour.error(), before / 3.0);
  expect_consistent(tour.map);
}

TEST(CloseLoop, SameInputSameBytes) {
  const auto closed = [] {
    DriftedTour tour;
    loop_correction().close_loop(tour.map, tour.keyframes[kCurrent], tour.match(kCurrent, kFound));
    return tour.map;
  };
  expect_same_map(closed(), closed());
}

TEST(CloseLoop, StoppedItLeavesTheMapAsItWas) {
  DriftedTour tour;
  const Map before = tour.map;
  const std::atomic<bool> abort = true;
  EXPECT_FALSE(loop_correction()
                   .close_loop(tour.map, tour.keyframes[kCurrent], tour.match(kCurrent, kFound), &abort)
                   .done);
  expect_same_map(tour.map, before);
  EXPECT_TRUE(tour.map.loops().empty());
}

// One turn and a bit in two parts; the younger one's world stands anywhere.
struct TwoParts {
  static constexpr std::size_t kFirst = 12, kOverlap = 4;
  explicit TwoParts(bool match_from_younger = true) : tour(0, kFirst, still) {
    tour.extend(tour.map, kFirst - kOverlap, 2 * kFirst, still);
    displace();
    current = tour.keyframes.size() - 2 * kOverlap;  // in the younger part
    found = kFirst - 1;
    for (std::size_t i = kFirst; i < tour.keyframes.size(); ++i)
      if (pose_difference(tour.truth[i], tour.truth[found]) < 1e-12) current = i;
    if (!match_from_younger) std::swap(current, found);
  }
  // The younger part's world is another one.
  void displace() {
    const SE3 T = SE3::exp((Vector6d() << 2.0, -1.0, 3.0, 0.2, 0.9, -0.4).finished());  // old -> new world
    std::set<PointId> points;
    for (std::size_t i = kFirst; i < tour.keyframes.size(); ++i) {
      const KeyframeId id = tour.keyframes[i];
      tour.map.set_pose(id, tour.map.keyframes()[id].T_cw * T.inverse());
      for (const PointId point : tour.map.keyframes()[id].points) points.insert(point);
    }
    for (const PointId id : points) {
      tour.map.set_position(id, T * tour.map.points()[id].position);
      tour.map.refresh(id);
    }
  }
  // A match that is a little off, as matches are.
  [[nodiscard]] PlaceMatch match() const {
    PlaceMatch match = tour.match(current, found);
    match.T_cw = SE3::exp((Vector6d() << 0.008, -0.006, 0.008, 0.002, -0.002, 0.002).finished()) * match.T_cw;
    return match;
  }
  const Vector6d still = Vector6d::Zero();
  DriftedTour tour;
  std::size_t current = 0, found = 0;
};

TEST(MergeParts, TheyFit) {
  for (const bool from_younger : {true, false}) {
    TwoParts t(from_younger);
    const SE3 anchor = t.tour.map.keyframes()[t.tour.keyframes[0]].T_cw;
    ASSERT_EQ(t.tour.map.parts().size(), 2U);
    const CorrectionEffect effect =
        loop_correction().merge_parts(t.tour.map, t.tour.keyframes[t.current], t.match());
    EXPECT_TRUE(effect.done);
    EXPECT_EQ(t.tour.map.parts(), std::vector<PartId>{PartId{0}});
    expect_same_pose(t.tour.map.keyframes()[t.tour.keyframes[0]].T_cw, anchor);
    // The match was off by 13 mm and 3.5 mrad; hundreds of points with a third of a pixel know it better.
    EXPECT_LT(t.tour.error(), 0.005) << "from the younger part: " << from_younger;
    EXPECT_GT(effect.points, 100U);
    EXPECT_LT(t.tour.reprojection_error(), 0.6);
    ASSERT_EQ(t.tour.map.loops().size(), 1U);
    expect_consistent(t.tour.map);
  }
}

TEST(MergeParts, KeyframesBeyondTheSeamFollow) {
  TwoParts t;
  LoopCorrectionOptions options;
  options.side_keyframes = 4;
  loop_correction(options).merge_parts(t.tour.map, t.tour.keyframes[t.current], t.match());
  EXPECT_LT(t.tour.error(), 0.01);
  EXPECT_LT(t.tour.reprojection_error(), 0.6);
  expect_consistent(t.tour.map);
}

TEST(MergeParts, StoppedThePartsAreOneAllTheSame) {
  TwoParts t;
  const std::atomic<bool> abort = true;
  loop_correction().merge_parts(t.tour.map, t.tour.keyframes[t.current], t.match(), &abort);
  EXPECT_EQ(t.tour.map.parts().size(), 1U);
  EXPECT_LT(t.tour.error(), 0.05) << "where the match put them";
  expect_consistent(t.tour.map);
}

TEST(MergeParts, SameInputSameBytes) {
  const auto merged = [] {
    TwoParts t;
    loop_correction().merge_parts(t.tour.map, t.tour.keyframes[t.current], t.match());
    return t.tour.map;
  };
  expect_same_map(merged(), merged());
}

}  // namespace
}  // namespace ipl_slam
