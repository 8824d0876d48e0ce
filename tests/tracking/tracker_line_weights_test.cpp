// The tracker told in which regions of the image lines may not say where the camera is.

#include <map>

#include <gtest/gtest.h>

#include "support/line_world.hpp"
#include "tracking/tracker.hpp"

namespace ipl_slam {
namespace {

using namespace test;

// Lines are found to about a tenth of a pixel, half a millimetre at 2.5 m; tens of them in all directions
// leave less than that.
constexpr double kSettledOnLines = 1e-3;
constexpr int kBorder = 320;  // from this column on the image is dynamic
const SE3 kNow = camera_at({0.004, -0.002, 0.003}, 0.003, 0.002);

// A tracker in a world of rectangles without a single keypoint; the map was started at the origin.
struct OnLines {
  explicit OnLines(double max_dynamic_share = 0.2)
      : tracker(kTestCamera, kTestPyramid, kTestNoise, options(max_dynamic_share)) {
    const LineView first = world.look({}, 0);
    TrackedFrame tracked = tracker.track(first.frame, nullptr);
    map.add(first);
    local = map.snapshot();
    tracked.state = TrackingState::kTracking;
    tracked.reference = KeyframeId{0};
    tracker.start(tracked);
  }
  static TrackerOptions options(double max_dynamic_share) {
    TrackerOptions o;
    o.line_support = 3.0;
    o.min_inliers = 30;
    o.max_dynamic_share = max_dynamic_share;
    o.lines.max_lines = 1000;
    return o;
  }
  TrackedFrame track(const cv::Mat& grey, FeatureWeights weights) {
    return tracker.track(SyntheticWorld::make_frame({}, 1), local, grey, {}, std::move(weights));
  }
  // Share of a landmark's image that lies right of the border, as the camera at kNow sees it.
  [[nodiscard]] double share_right(LineId id) const {
    const Line& line = map.map.lines()[id];
    const Eigen::Vector2d a = kTestCamera.project(kNow * line.start),
                          b = kTestCamera.project(kNow * line.end);
    const double low = std::min(a.x(), b.x()), high = std::max(a.x(), b.x());
    return std::clamp((high - kBorder) / (high - low), 0.0, 1.0);
  }

  LineWorld world;
  LineWorldMap map{world};
  Tracker tracker;
  std::shared_ptr<const LocalMap> local;
};

FeatureWeights right_half() {
  FeatureWeights weights;
  weights.dynamic = BitMask(cv::Size(kTestCamera.width, kTestCamera.height));
  for (int y = 0; y < kTestCamera.height; ++y) weights.dynamic.set_run(y, kBorder, kTestCamera.width);
  return weights;
}

TEST(TrackerLineWeights, LinesInDynamicRegionsAreNotUsed) {
  OnLines s;
  const TrackedFrame tracked = s.track(s.world.image(kNow), right_half());
  ASSERT_EQ(tracked.state, TrackingState::kTracking);
  EXPECT_LT(pose_difference(tracked.T_cw, kNow), kSettledOnLines);
  EXPECT_GT(tracked.lines.size(), 15U);
  for (const SeenLine& seen : tracked.lines) EXPECT_LT(s.share_right(seen.line), 0.3);

  OnLines all;
  const TrackedFrame of_all = all.track(all.world.image(kNow), {});
  EXPECT_GT(of_all.lines.size(), 1.5 * static_cast<double>(tracked.lines.size()));
}

TEST(TrackerLineWeights, AShareInDynamicRegionsIsAllowed) {
  // The upright border cuts through level edges only; some of them lie right of it by half or less.
  const auto used = [](double max_dynamic_share) {
    OnLines s(max_dynamic_share);
    return s.track(s.world.image(kNow), right_half()).lines.size();
  };
  EXPECT_EQ(used(1.0), OnLines().track(OnLines().world.image(kNow), {}).lines.size());
  EXPECT_GT(used(1.0), used(0.2));
}

TEST(TrackerLineWeights, WhatMovesInADynamicRegionDoesNotCarryThePoseAway) {
  // Right of the border the picture is 2 px lower than it should be.
  OnLines s;
  const cv::Mat still = s.world.image(kNow);
  cv::Mat grey = still.clone();
  still(cv::Rect(kBorder, 0, 320, 478)).copyTo(grey(cv::Rect(kBorder, 2, 320, 478)));
  const TrackedFrame tracked = s.track(grey, right_half());
  ASSERT_EQ(tracked.state, TrackingState::kTracking);
  EXPECT_LT(pose_difference(tracked.T_cw, kNow), kSettledOnLines);
  EXPECT_GT(pose_difference(OnLines().track(grey, {}).T_cw, kNow), 2.0 * kSettledOnLines);
}

TEST(TrackerLineWeights, WhereAllIsDynamicThereIsNoPose) {
  OnLines s;
  FeatureWeights weights = right_half();
  for (int y = 0; y < kTestCamera.height; ++y) weights.dynamic.set_run(y, 0, kTestCamera.width);
  EXPECT_EQ(s.track(s.world.image(kNow), weights).state, TrackingState::kLost);
}

TEST(TrackerLineWeights, ALineBehindADynamicRegionIsNotExpected) {
  OnLines s;
  cv::Mat grey = s.world.image(kNow);
  grey.colRange(kBorder, kTestCamera.width).setTo(90);  // somebody stands there
  ASSERT_EQ(s.track(grey, right_half()).state, TrackingState::kTracking);
  int beside = 0;
  for (const Sighting<LineId>& sighting : s.tracker.take_line_sightings()) {
    // What is hidden in part may still be found.
    EXPECT_TRUE(s.share_right(sighting.landmark) < 0.3 || sighting.found == 1);
    EXPECT_LT(s.share_right(sighting.landmark), 0.9) << "line " << sighting.landmark.value;
    beside += sighting.found;
  }
  EXPECT_GT(beside, 15);
}

TEST(TrackerLineWeights, ALineThatIsGoneBesideADynamicRegionIsMissed) {
  OnLines s;
  cv::Mat grey = s.world.image(kNow);
  grey.colRange(200, kTestCamera.width).setTo(90);  // only right of the border anybody is known to stand
  ASSERT_EQ(s.track(grey, right_half()).state, TrackingState::kTracking);
  int missed = 0;
  for (const Sighting<LineId>& sighting : s.tracker.take_line_sightings()) {
    missed += sighting.visible - sighting.found;
  }
  EXPECT_GT(missed, 5);
}

}  // namespace
}  // namespace ipl_slam
