// The tracker told which points may say where the camera is.

#include <map>

#include <gtest/gtest.h>

#include "support/world_map.hpp"
#include "tracking/tracker.hpp"

namespace ipl_slam {
namespace {

using namespace test;

// What float pixels and depths leave.
constexpr double kExact = 1e-5;

SE3 on_path(std::size_t index) {
  const double t = static_cast<double>(index);
  return camera_at({0.01 * t, 0.0, 0.004 * t}, 0.004 * t, 0.002 * t);
}

// A tracker whose map was started with frame 0 of the path, and perfect landmarks. From frame 1 on, those
// points of the world that `moves` names go along with something.
class WithMovers {
 public:
  explicit WithMovers(const TrackerOptions& options = {})
      : tracker(kTestCamera, kTestPyramid, kTestNoise, options) {
    const View first = world.look(on_path(0), 0);
    TrackedFrame tracked = tracker.track(first.frame, nullptr);
    map.add(first);
    local = map.snapshot();
    tracked.state = TrackingState::kTracking;
    tracked.reference = KeyframeId{0};
    tracker.start(tracked);
  }

  static bool moves(std::uint32_t source) { return source % 3 != 0; }

  // A frame in which two thirds of all points moved together, as if the camera had gone elsewhere.
  View look(std::size_t index, const Eigen::Vector3d& moved = {0.0, 0.02, 0.0}) const {
    View view = world.look(on_path(index), index);
    Features features = view.frame->features;
    for (std::size_t k = 0; k < view.sources.size(); ++k) {
      if (!moves(view.sources[k])) continue;
      const Eigen::Vector3d p_c = on_path(index) * (world.position(view.sources[k]) + moved);
      features.keypoints[k].pixel = features.keypoints[k].undistorted =
          kTestCamera.project(p_c).cast<float>();
      features.keypoints[k].depth = static_cast<float>(p_c.z());
    }
    view.frame = SyntheticWorld::make_frame(std::move(features), index);
    return view;
  }
  static std::vector<std::uint8_t> witnesses(const View& view) {
    std::vector<std::uint8_t> witness;
    for (const std::uint32_t source : view.sources) witness.push_back(moves(source) ? 0 : 1);
    return witness;
  }
  static FeatureWeights removing_movers(const View& view, double weight = 0.0) {
    FeatureWeights weights;
    for (const std::uint32_t source : view.sources) weights.points.push_back(moves(source) ? weight : 1.0);
    return weights;
  }
  TrackedFrame track(const View& view, FeatureWeights weights = {}) {
    return tracker.track(view.frame, local, {}, {}, std::move(weights));
  }

  SyntheticWorld world;
  WorldMap map{world};
  Tracker tracker;
  std::shared_ptr<const LocalMap> local;
};

// No point of weight 0 has a landmark, and hardly any other is without.
void expect_used(const TrackedFrame& tracked, const FeatureWeights& weights) {
  int used = 0;
  for (std::size_t k = 0; k < tracked.points.size(); ++k) {
    if (!tracked.points[k].valid()) continue;
    ++used;
    EXPECT_GT(weights.points[k], 0.0) << "keypoint " << k;
  }
  EXPECT_EQ(used, tracked.inliers);
  EXPECT_GT(used, 100);
}

TEST(TrackerWeights, RemovedPointsAreNotUsed) {
  WithMovers s;
  for (std::size_t i = 1; i <= 5; ++i) {
    const View view = s.look(i, {0.0, 0.02 * static_cast<double>(i), 0.0});
    const FeatureWeights weights = WithMovers::removing_movers(view);
    const TrackedFrame tracked = s.track(view, weights);
    ASSERT_EQ(tracked.state, TrackingState::kTracking);
    EXPECT_LT(pose_difference(tracked.T_cw, on_path(i)), kExact) << "frame " << i;
    expect_used(tracked, weights);
    EXPECT_EQ(tracked.weights.points, weights.points) << "the map learns of them";
  }
}

TEST(TrackerWeights, WithoutThemTheManyThatMoveWouldCarryThePoseAway) {
  WithMovers s;
  // So much for the test before this one.
  EXPECT_GT(pose_difference(s.track(s.look(1)).T_cw, on_path(1)), 0.005);
}

TEST(TrackerWeights, RemovedPointsAreNotUsedEvenWhereTheyFit) {
  WithMovers s;
  for (std::size_t i = 1; i <= 3; ++i) {
    const View view = s.look(i, {0.0, 0.0, 0.0});
    const FeatureWeights weights = WithMovers::removing_movers(view);
    expect_used(s.track(view, weights), weights);
  }
}

TEST(TrackerWeights, ARemovedPointDoesNotTakeTheLandmarkOfAnother) {
  // Beside each keypoint, somewhat changed by noise, lies one that is removed and looks exactly alike.
  WithMovers s;
  for (std::size_t i = 1; i <= 3; ++i) {
    const Features exact = s.world.look(on_path(i), i).frame->features;
    Features features = s.world.look(on_path(i), i, {.flipped_bits = 20}).frame->features;
    FeatureWeights weights;
    weights.points.assign(features.size(), 1.0);
    for (std::size_t k = 0; k < exact.size(); ++k) {
      features.keypoints.push_back(exact.keypoints[k]);
      features.keypoints.back().undistorted.x() += 1.0F;
      features.descriptors.push_back(exact.descriptors[k]);
      weights.points.push_back(0.0);
    }
    const TrackedFrame tracked = s.track({SyntheticWorld::make_frame(features, i), {}, {}}, weights);
    expect_used(tracked, weights);
    EXPECT_GT(tracked.inliers, static_cast<int>(0.8 * static_cast<double>(exact.size()))) << "frame " << i;
  }
}

TEST(TrackerWeights, RemovedPointsDoNotBringALostCameraBack) {
  WithMovers s;
  const auto lose = [&](std::size_t index) {
    return s.track({SyntheticWorld::make_frame({}, index), {}, {}});
  };
  ASSERT_EQ(lose(1).state, TrackingState::kLost);
  // They have gone so far that a pose that follows them finds nothing of what stands.
  const View view = s.look(30, {0.3, 0.2, 0.0});
  FeatureWeights weights = WithMovers::removing_movers(view);
  const TrackedFrame back = s.track(view, weights);
  ASSERT_EQ(back.state, TrackingState::kTracking);
  EXPECT_LT(pose_difference(back.T_cw, on_path(30)), kExact);
  expect_used(back, weights);

  ASSERT_EQ(lose(31).state, TrackingState::kLost);
  const View next = s.look(32);
  weights = WithMovers::removing_movers(next);
  for (double& weight : weights.points) weight = 0.0;
  const TrackedFrame nothing_left = s.track(next, weights);
  EXPECT_EQ(nothing_left.state, TrackingState::kLost);
  for (const PointId id : nothing_left.points) EXPECT_FALSE(id.valid());
}

TEST(TrackerWeights, WhatWasRemovedInTheLastFrameDoesNotCarryTheNext) {
  // What is removed has no landmark; its own depth would place it. Here it stands in the frames of the
  // movers: they moved in frame 1, and keep their distance from the camera in frame 2.
  WithMovers s;
  const View first = s.look(1, {0.0, 0.5, 0.0});
  (void)s.track(first, WithMovers::removing_movers(first));
  const View second = s.look(2, {0.0, 0.52, 0.0});
  const auto T_cw =
      s.tracker.first_pose(*second.frame, s.local, std::vector<std::uint8_t>(second.sources.size(), 1));
  ASSERT_TRUE(T_cw);
  EXPECT_LT(pose_difference(*T_cw, on_path(2)), kExact);
}

TEST(TrackerWeights, AWeightSaysHowMuchAPointPulls) {
  // The movers are a millimetre off, a fifth of a pixel: all of them are inliers. Where all pull alike two
  // thirds of it are taken for the camera's motion; where they weigh 0.01, 0.02 of 1.02 parts.
  const auto error = [](double weight) {
    WithMovers s;
    const View view = s.look(1, {0.0, 0.001, 0.0});
    const TrackedFrame tracked = s.track(view, WithMovers::removing_movers(view, weight));
    EXPECT_GT(tracked.inliers, static_cast<int>(0.9 * static_cast<double>(view.sources.size())))
        << "how far off a point may be does not depend on its weight";
    return pose_difference(tracked.T_cw, on_path(1));
  };
  EXPECT_NEAR(error(1.0), 0.001 * 2.0 / 3.0, 0.0002);  // the points are not spread evenly
  EXPECT_NEAR(error(0.01), 0.001 * 0.02 / 1.02, 0.00002);
}

TEST(FirstPose, ComesFromTheWitnesses) {
  WithMovers s;
  const View view = s.look(1);
  const auto T_cw = s.tracker.first_pose(*view.frame, s.local, WithMovers::witnesses(view));
  ASSERT_TRUE(T_cw);
  EXPECT_LT(pose_difference(*T_cw, on_path(1)), kExact);
  const auto of_all =
      s.tracker.first_pose(*view.frame, s.local, std::vector<std::uint8_t>(view.sources.size(), 1));
  ASSERT_TRUE(of_all);
  EXPECT_GT(pose_difference(*of_all, on_path(1)), 0.005) << "the movers are many";
}

TEST(FirstPose, DoesNotChangeWhatIsTracked) {
  WithMovers with, without;
  for (std::size_t i = 1; i <= 3; ++i) {
    const View view = with.look(i);
    (void)with.tracker.first_pose(*view.frame, with.local, WithMovers::witnesses(view));
    const FeatureWeights weights = WithMovers::removing_movers(view);
    const SE3 a = with.track(view, weights).T_cw, b = without.track(view, weights).T_cw;
    EXPECT_EQ(a.translation(), b.translation());
    EXPECT_EQ(a.rotation().coeffs(), b.rotation().coeffs());
  }
}

TEST(FirstPose, NeedsAMapAndEnoughWitnesses) {
  TrackerOptions options;
  options.min_prediction_inliers = 20;
  WithMovers s(options);
  const View view = s.look(1);
  EXPECT_FALSE(s.tracker.first_pose(*view.frame, nullptr, WithMovers::witnesses(view)));
  std::vector<std::uint8_t> few(view.sources.size(), 0);
  EXPECT_FALSE(s.tracker.first_pose(*view.frame, s.local, few));
  const auto call = [&](int count) {
    for (std::size_t k = 0; k < few.size() && count > 0; ++k) {
      if (few[k] || WithMovers::moves(view.sources[k])) continue;
      few[k] = 1;
      --count;
    }
  };
  call(19);
  EXPECT_FALSE(s.tracker.first_pose(*view.frame, s.local, few));
  call(60);
  EXPECT_TRUE(s.tracker.first_pose(*view.frame, s.local, few));
}

TEST(FirstPose, IsNotToBeHadWhileTheCameraIsLost) {
  WithMovers s;
  ASSERT_EQ(s.track({SyntheticWorld::make_frame({}, 1), {}, {}}).state, TrackingState::kLost);
  const View view = s.look(2);
  EXPECT_FALSE(s.tracker.first_pose(*view.frame, s.local, WithMovers::witnesses(view)));
}

// The right third of the image is dynamic.
FeatureWeights right_third(const View& view) {
  FeatureWeights weights;
  weights.dynamic = BitMask(cv::Size(kTestCamera.width, kTestCamera.height));
  for (int y = 0; y < kTestCamera.height; ++y) weights.dynamic.set_run(y, 427, kTestCamera.width);
  for (const Keypoint& k : view.frame->features.keypoints) {
    weights.points.push_back(weights.in_dynamic(k.pixel.cast<double>()) ? 0.0 : 1.0);
  }
  return weights;
}

TEST(TrackerSightings, ALandmarkBehindADynamicRegionIsNotExpected) {
  WithMovers s;
  const View view = s.world.look(on_path(1), 1);
  const TrackedFrame tracked = s.track(view, right_third(view));
  ASSERT_EQ(tracked.state, TrackingState::kTracking);
  int beside = 0;
  for (const Sighting<PointId>& sighting : s.tracker.take_sightings()) {
    const Eigen::Vector2d uv =
        kTestCamera.project(on_path(1) * s.map.map.points()[sighting.landmark].position);
    EXPECT_LT(uv.x(), 427.5) << "landmark " << sighting.landmark.value;
    EXPECT_EQ(sighting.found, 1);
    beside += uv.x() < 426.0 ? 1 : 0;
  }
  EXPECT_GT(beside, 100);
}

TEST(TrackerSightings, ALandmarkWhoseKeypointAloneIsRemovedIsExpected) {
  // Nothing is known to stand before it: it may have gone.
  WithMovers s;
  const View view = s.world.look(on_path(1), 1);
  (void)s.track(view, WithMovers::removing_movers(view));
  int missed = 0;
  for (const Sighting<PointId>& sighting : s.tracker.take_sightings()) {
    missed += sighting.visible - sighting.found;
  }
  EXPECT_GT(missed, 100);
}

}  // namespace
}  // namespace ipl_slam
