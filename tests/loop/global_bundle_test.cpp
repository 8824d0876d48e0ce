#include "loop/global_bundle.hpp"

#include <gtest/gtest.h>

#include "loop/drifted_tour.hpp"
#include "support/map_checks.hpp"

namespace ipl_slam {
namespace {

using namespace test;

constexpr std::size_t kCurrent = DriftedTour::kKeyframes - 1, kFound = kCurrent - DriftedTour::kTurn;

GlobalBundle bundle_of(const Map& map) {
  return {map, PartId{0}, kTestCamera, kTestNoise, LineNoise{}, BundleOptions{}};
}

// A tour whose loop is closed, with keyframes that are a centimetre or two off on top of what was left of the
// drift.
struct Closed {
  Closed() {
    loop_correction().close_loop(tour.map, tour.keyframes[kCurrent], tour.match(kCurrent, kFound));
    Random random(4);
    for (std::size_t i = 1; i < tour.keyframes.size(); ++i) {
      Vector6d twist;
      for (int k = 0; k < 6; ++k) twist[k] = 0.01 * random.normal();
      const KeyframeId id = tour.keyframes[i];
      tour.map.set_pose(id, SE3::exp(twist) * tour.map.keyframes()[id].T_cw);
    }
  }
  DriftedTour tour;
};

TEST(GlobalBundle, RecoversTheTour) {
  Closed c;
  const double before = c.tour.error();
  const SE3 anchor = c.tour.map.keyframes()[c.tour.keyframes[0]].T_cw;
  GlobalBundle bundle = bundle_of(c.tour.map);
  ASSERT_TRUE(bundle.solve());
  ASSERT_TRUE(bundle.apply(c.tour.map));
  EXPECT_GT(before, 0.015);
  EXPECT_LT(c.tour.error(), 0.5 * before);
  EXPECT_LT(c.tour.error(), 0.01);
  EXPECT_LT(c.tour.reprojection_error(), 0.6) << "the noise is 0.3 px at the finest level";
  EXPECT_EQ(c.tour.map.keyframes()[c.tour.keyframes[0]].T_cw.translation(), anchor.translation());
  expect_consistent(c.tour.map);
}

TEST(GlobalBundle, SameInputSameBytes) {
  const auto adjusted = [] {
    Closed c;
    GlobalBundle bundle = bundle_of(c.tour.map);
    bundle.solve();
    bundle.apply(c.tour.map);
    return c.tour.map;
  };
  const Map a = adjusted(), b = adjusted();
  a.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    EXPECT_EQ(keyframe.T_cw.translation(), b.keyframes()[id].T_cw.translation());
  });
  ASSERT_EQ(a.points().size(), b.points().size());
  a.points().for_each(
      [&](PointId id, const Point& point) { EXPECT_EQ(point.position, b.points()[id].position); });
}

TEST(GlobalBundle, StoppedThereIsNothingToApply) {
  Closed c;
  const double before = c.tour.error();
  GlobalBundle bundle = bundle_of(c.tour.map);
  const std::atomic<bool> abort = true;
  EXPECT_FALSE(bundle.solve(&abort));
  EXPECT_FALSE(bundle.apply(c.tour.map));
  EXPECT_EQ(c.tour.error(), before);
}

TEST(GlobalBundle, WhatCameAfterTheCopyFollows) {
  Closed c;
  Map& map = c.tour.map;
  GlobalBundle bundle = bundle_of(map);
  // Meanwhile a keyframe arrives that sees what the newest one does, and a landmark of its own; another one
  // sees nothing known.
  const KeyframeId newest = c.tour.keyframes[kCurrent];
  const SE3 step = SE3::exp((Vector6d() << 0.05, 0.0, 0.02, 0.0, 0.01, 0.0).finished());
  const View& view = c.tour.views[kCurrent];
  const KeyframeId next = map.add_keyframe(view.frame, step * map.keyframes()[newest].T_cw);
  std::uint32_t free = 0;
  for (std::uint32_t k = 0; k < view.sources.size(); ++k) {
    const PointId point = map.keyframes()[newest].points[k];
    if (point.valid() && k % 4 != 0) map.add_observation(point, next, k);
    if (!map.keyframes()[next].points[k].valid()) free = k;
  }
  const PointId own = map.add_point({0.1, 0.2, 3.0}, next, free);
  const Eigen::Vector3d own_c = map.keyframes()[next].T_cw * map.points()[own].position;
  const KeyframeId lonely = map.add_keyframe(view.frame, step * map.keyframes()[next].T_cw);

  const KeyframeId nearest = map.covisible(next).front().keyframe;
  const SE3 before = map.keyframes()[next].T_cw;
  const SE3 T_next_nearest = before * map.keyframes()[nearest].T_cw.inverse();
  ASSERT_TRUE(bundle.solve());
  ASSERT_TRUE(bundle.apply(map));
  const SE3 after = map.keyframes()[next].T_cw;
  EXPECT_GT(pose_difference(before, after), 1e-3);
  EXPECT_LT(pose_difference(after, T_next_nearest * map.keyframes()[nearest].T_cw), 1e-9);
  EXPECT_LT(pose_difference(map.keyframes()[lonely].T_cw, step * after), 1e-9);
  EXPECT_LT((after * map.points()[own].position - own_c).norm(), 1e-9);
  expect_consistent(map);
}

TEST(GlobalBundle, WhatIsGoneMeanwhileStaysGone) {
  Closed c;
  Map& map = c.tour.map;
  GlobalBundle bundle = bundle_of(map);
  const KeyframeId culled = c.tour.keyframes[20];
  map.remove_keyframe(culled);
  std::vector<PointId> removed;
  for (const PointId point : std::vector(map.keyframes()[c.tour.keyframes[30]].points)) {
    if (!point.valid() || removed.size() >= 20) continue;
    map.remove(point);
    removed.push_back(point);
  }
  ASSERT_TRUE(bundle.solve());
  ASSERT_TRUE(bundle.apply(map));
  EXPECT_FALSE(map.keyframes().contains(culled));
  for (const PointId point : removed) EXPECT_FALSE(map.points().contains(point));
  EXPECT_LT(c.tour.error(), 0.01);
  expect_consistent(map);
}

TEST(GlobalBundle, AResultThatALoopOvertookIsNotApplied) {
  Closed c;
  GlobalBundle bundle = bundle_of(c.tour.map);
  ASSERT_TRUE(bundle.solve());
  c.tour.map.add_loop({c.tour.keyframes[50], c.tour.keyframes[0], SE3()});
  const double before = c.tour.error();
  EXPECT_FALSE(bundle.apply(c.tour.map));
  EXPECT_EQ(c.tour.error(), before);
}

}  // namespace
}  // namespace ipl_slam
