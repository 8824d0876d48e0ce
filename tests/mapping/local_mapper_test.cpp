#include "mapping/local_mapper.hpp"

#include <gtest/gtest.h>

#include "support/candidate.hpp"
#include "support/line_world.hpp"
#include "support/map_checks.hpp"
#include "support/mapped.hpp"
#include "support/synthetic_world.hpp"
#include "tracking/tracker.hpp"

namespace ipl_slam {
namespace {

using namespace test;

Mapped make_mapper(const MappingOptions& options = {}) {
  return Mapped({kTestCamera, kTestPyramid, kTestNoise, options}, options.local_map);
}

// A candidate with the landmarks that the keypoints show: those of a keyframe that took another view.
KeyframeCandidate candidate_after(const View& view, const Map& map, const View& other, KeyframeId other_id) {
  KeyframeCandidate result = candidate(view, other_id, view.T_cw * other.T_cw.inverse());
  for (std::size_t k = 0; k < view.sources.size(); ++k) {
    const int there = other.keypoint_of(view.sources[k]);
    if (there >= 0) result.tracked.points[k] = map.keyframes()[other_id].points[there];
  }
  return result;
}

TEST(LocalMapper, TheFirstKeyframeStartsTheMapAtItsOwnPose) {
  const SyntheticWorld world;
  Mapped mapper = make_mapper();
  const View view = world.look(camera_at({0.1, 0.2, 0.0}, 0.1));
  const auto local = mapper.process(candidate(view));
  ASSERT_EQ(mapper.map().keyframes().size(), 1U);
  EXPECT_EQ(mapper.map().pose_of(KeyframeId{0}).translation(), view.T_cw.translation());
  EXPECT_EQ(mapper.map().pose_of(KeyframeId{0}).rotation().coeffs(), view.T_cw.rotation().coeffs());
  EXPECT_EQ(mapper.map().points().size(), view.frame->features.size());
  EXPECT_EQ(local->points.size(), view.frame->features.size());
  EXPECT_EQ(local->keyframes.size(), 1U);
  for (std::size_t k = 0; k < view.sources.size(); ++k) {
    const PointId id = mapper.map().keyframes()[KeyframeId{0}].points[k];
    // Float pixels and depths, at 4 m and less.
    EXPECT_LT((mapper.map().points()[id].position - world.position(view.sources[k])).norm(), 1e-5);
    EXPECT_EQ(mapper.map().points()[id].descriptor, world.descriptor(view.sources[k]));
  }
  expect_consistent(mapper.map());
}

TEST(LocalMapper, MakesLandmarksOfKeypointsWithDepth) {
  const SyntheticWorld world;
  Mapped mapper = make_mapper();
  const View view = world.look(camera_at({0.0, 0.0, 0.0}), 0, {.depth_share = 0.7});
  (void)mapper.process(candidate(view));
  int with = 0, without = 0;
  for (std::size_t k = 0; k < view.sources.size(); ++k) {
    const float depth = view.frame->features.keypoints[k].depth;
    const bool landmark = mapper.map().keyframes()[KeyframeId{0}].points[k].valid();
    EXPECT_EQ(landmark, depth > 0.0F) << "at " << depth << " m";
    ++(depth > 0.0F ? with : without);
  }
  EXPECT_TRUE(with > 20 && without > 20) << "both kinds should have been there";
}

TEST(LocalMapper, ASecondKeyframeSeesTheLandmarksItWasTrackedBy) {
  const SyntheticWorld world;
  Mapped mapper = make_mapper();
  const View first = world.look(camera_at({0.0, 0.0, 0.0}), 0),
             second = world.look(camera_at({0.2, 0.0, 0.0}), 10);
  (void)mapper.process(candidate(first));
  const std::size_t landmarks = mapper.map().points().size();
  const auto local = mapper.process(candidate_after(second, mapper.map(), first, KeyframeId{0}));
  int shared = 0, fresh = 0;
  for (std::size_t k = 0; k < second.sources.size(); ++k) {
    const int there = first.keypoint_of(second.sources[k]);
    const PointId id = mapper.map().keyframes()[KeyframeId{1}].points[k];
    ++(there >= 0 ? shared : fresh);
    if (there < 0) continue;
    EXPECT_EQ(id, mapper.map().keyframes()[KeyframeId{0}].points[there]);
  }
  EXPECT_EQ(mapper.map().points().size(), landmarks + static_cast<std::size_t>(fresh));
  EXPECT_EQ(mapper.map().covisible(KeyframeId{1}).front().shared, shared);
  EXPECT_EQ(local->keyframes.size(), 2U);
  // Nothing was wrong, so nothing moves but by rounding of floats.
  EXPECT_LT(pose_difference(mapper.map().pose_of(KeyframeId{1}), second.T_cw), 1e-5);
  expect_consistent(mapper.map());
}

TEST(LocalMapper, FindsByFusionWhatTrackingDidNotSay) {
  const SyntheticWorld world;
  Mapped mapper = make_mapper();
  const View first = world.look(camera_at({0.0, 0.0, 0.0}), 0),
             second = world.look(camera_at({0.2, 0.0, 0.0}), 10);
  (void)mapper.process(candidate(first));
  KeyframeCandidate next = candidate_after(second, mapper.map(), first, KeyframeId{0});
  int shared = 0;
  for (std::size_t k = 0; k < second.sources.size(); ++k) {
    shared += first.keypoint_of(second.sources[k]) >= 0 ? 1 : 0;
    if (k % 3 != 0) next.tracked.points[k] = PointId{};
  }
  (void)mapper.process(next);
  EXPECT_EQ(mapper.map().covisible(KeyframeId{1}).front().shared, shared);
  expect_consistent(mapper.map());
}

TEST(LocalMapper, PlacesAKeyframeWhereItsReferenceIsNow) {
  const SyntheticWorld world, elsewhere(77);
  Mapped mapper = make_mapper();
  const View first = world.look(camera_at({0.0, 0.0, 0.0}), 0),
             second = world.look(camera_at({0.2, 0.0, 0.0}), 10);
  (void)mapper.process(candidate(first));
  // The second comes in 3 cm beside its place; bundle adjustment moves it.
  const SE3 T_21_wrong = camera_at({0.23, 0.0, 0.0});
  KeyframeCandidate next = candidate_after(second, mapper.map(), first, KeyframeId{0});
  next.tracked.T_cw = next.tracked.T_c_reference = T_21_wrong;
  (void)mapper.process(next);
  ASSERT_LT(pose_difference(mapper.map().pose_of(KeyframeId{1}), second.T_cw), 1e-3);

  // A third one was tracked while the second still stood beside its place. It shows nothing that is known, so
  // that nothing but its reference tells where it is.
  const SE3 T_32 = camera_at({0.1, 0.0, 0.3}, 0.2);
  const View third = elsewhere.look(T_32 * T_21_wrong, 20);
  (void)mapper.process(candidate(third, KeyframeId{1}, T_32));
  const SE3 expected = T_32 * mapper.map().pose_of(KeyframeId{1});
  EXPECT_LT(pose_difference(mapper.map().pose_of(KeyframeId{2}), expected), 1e-9);
  EXPECT_GT(pose_difference(mapper.map().pose_of(KeyframeId{2}), third.T_cw), 0.02);
}

TEST(LocalMapper, CountsTheSightingsOfLandmarksThatAreStillThere) {
  const SyntheticWorld world;
  Mapped mapper = make_mapper();
  const View first = world.look(camera_at({0.0, 0.0, 0.0}), 0);
  (void)mapper.process(candidate(first));
  KeyframeCandidate next = candidate_after(first, mapper.map(), first, KeyframeId{0});
  next.sightings = {{PointId{3}, 5, 4}, {PointId{4}, 50, 1}};
  (void)mapper.process(next);
  EXPECT_EQ(mapper.map().points()[PointId{3}].visible, 6);
  EXPECT_EQ(mapper.map().points()[PointId{3}].found, 5);
  EXPECT_FALSE(mapper.map().points().contains(PointId{4})) << "rarely found";
  // The next report may still speak of it.
  next.sightings = {{PointId{4}, 5, 5}};
  (void)mapper.process(next);
  expect_consistent(mapper.map());
}

// Tracks 40 noisy frames of a walk; every fifth becomes a keyframe.
struct Walk {
  Walk() {
    const ViewOptions noisy{.pixel_noise = 0.5,
                            .inverse_depth_noise = 0.01,
                            .depth_share = 0.8,
                            .flipped_bits = 20,
                            .clutter_share = 0.2};
    for (std::size_t i = 0; i < 40; ++i) {
      const double t = static_cast<double>(i);
      truth.push_back(camera_at({0.02 * t, 0.0, 0.005 * t}, 0.006 * t));
      const View view = world.look(truth.back(), i, noisy);
      TrackedFrame tracked = tracker.track(view.frame, local);
      if (i == 0) {
        local = mapper.process({tracked, {}});
        tracked.state = TrackingState::kTracking;
        tracked.reference = KeyframeId{0};
        tracker.start(tracked);
      } else if (i % 5 == 0) {
        local = mapper.process({tracked, tracker.take_sightings()});
      }
      frames.push_back(tracked);
    }
  }
  SyntheticWorld world;
  Tracker tracker{kTestCamera, kTestPyramid, kTestNoise, {}};
  Mapped mapper = make_mapper();
  std::shared_ptr<const LocalMap> local;
  std::vector<SE3> truth;
  std::vector<TrackedFrame> frames;
};

TEST(LocalMapper, BuildsAMapThatKeepsACameraInPlace) {
  const Walk walk;
  for (std::size_t i = 0; i < walk.frames.size(); ++i) {
    ASSERT_EQ(walk.frames[i].state, TrackingState::kTracking) << "frame " << i;
    const SE3 T_cw = walk.frames[i].T_c_reference * walk.mapper.map().pose_of(walk.frames[i].reference);
    // Half a pixel and 0.01 / m of noise are a few millimetres and 9 cm at 3 m; the average over hundreds of
    // points and eight keyframes drifts by no more than a centimetre or a hundredth of a radian.
    EXPECT_LT(pose_difference(T_cw, walk.truth[i]), 0.02) << "frame " << i;
  }
  expect_consistent(walk.mapper.map());
  EXPECT_GT(walk.mapper.map().points().size(), 300U);
}

TEST(LocalMapper, TheSameInputGivesTheSameMap) {
  const auto numbers_of = [](const Walk& walk) {
    std::vector<double> numbers;
    const Map& map = walk.mapper.map();
    map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
      numbers.push_back(id.value);
      for (int k = 0; k < 3; ++k) numbers.push_back(keyframe.T_cw.translation()[k]);
      for (int k = 0; k < 4; ++k) numbers.push_back(keyframe.T_cw.rotation().coeffs()[k]);
      for (const PointId point : keyframe.points) numbers.push_back(point.value);
    });
    map.points().for_each([&](PointId id, const Point& point) {
      numbers.push_back(id.value);
      for (int k = 0; k < 3; ++k) numbers.push_back(point.position[k]);
      for (int k = 0; k < 3; ++k) numbers.push_back(point.normal[k]);
      numbers.insert(numbers.end(), {point.max_distance, 1.0 * point.visible, 1.0 * point.found});
    });
    return numbers;
  };
  EXPECT_EQ(numbers_of(Walk{}), numbers_of(Walk{}));
}

// A candidate of lines only, which were tracked as they lie in the map.
KeyframeCandidate line_candidate(const LineView& view, const Map& map, KeyframeId reference = {},
                                 const SE3& T_c_reference = {}) {
  KeyframeCandidate result;
  result.tracked.frame = view.frame;
  result.tracked.state = TrackingState::kTracking;
  result.tracked.T_cw = view.T_cw;
  result.tracked.reference = reference;
  result.tracked.T_c_reference = T_c_reference;
  map.lines().for_each([&](LineId id, const Line& line) {
    result.tracked.lines.push_back(
        {id, kTestCamera.project(view.T_cw * line.start), kTestCamera.project(view.T_cw * line.end)});
  });
  result.lines = view.lines;
  return result;
}

// A mapper that took in the view from the origin.
struct LineMapper {
  explicit LineMapper(const MappingOptions& options = {}) : mapper(make_mapper(options)) {
    local = mapper.process(line_candidate(first, mapper.map()));
  }
  // A candidate of a view that stands as it should to the first keyframe, but for an error.
  [[nodiscard]] KeyframeCandidate after_first(const LineView& view, const SE3& error = {}) const {
    return line_candidate(view, mapper.map(), KeyframeId{0}, error * view.T_cw * first.T_cw.inverse());
  }
  LineWorld world;
  LineView first = world.look(camera_at({0.0, 0.0, 0.0}), 0);
  Mapped mapper;
  std::shared_ptr<const LocalMap> local;
};

TEST(LocalMapperLines, TheFirstKeyframeStartsTheMap) {
  const LineMapper m;
  EXPECT_EQ(m.mapper.map().lines().size(), m.first.lines->size());
  EXPECT_EQ(m.local->lines.size(), m.first.lines->size());
  EXPECT_TRUE(m.local->points.empty());
  expect_consistent(m.mapper.map());
}

TEST(LocalMapperLines, ASecondKeyframeSharesTheLinesItShowsAndMakesTheOthers) {
  LineMapper m;
  const LineView second = m.world.look(camera_at({0.15, 0.05, 0.0}, 0.1), 10);
  const auto local = m.mapper.process(m.after_first(second));
  const Map& map = m.mapper.map();
  int shared = 0;
  for (std::size_t s = 0; s < second.sources.size(); ++s) {
    const int there = m.first.segment_of(second.sources[s]);
    const LineId id = map.keyframes()[KeyframeId{1}].lines[s];
    ASSERT_TRUE(id.valid());
    EXPECT_EQ(map.lines()[id].observations.size(), there >= 0 ? 2U : 1U);
    if (there < 0) continue;
    ++shared;
    EXPECT_EQ(id, map.keyframes()[KeyframeId{0}].lines[static_cast<std::size_t>(there)]);
  }
  EXPECT_GT(shared, 40);
  EXPECT_LT(static_cast<std::size_t>(shared), second.sources.size()) << "some should be new";
  EXPECT_EQ(map.lines().size(),
            m.first.sources.size() + second.sources.size() - static_cast<std::size_t>(shared));
  EXPECT_EQ(map.covisible(KeyframeId{1}).front().shared, shared);
  EXPECT_EQ(local->lines.size(), map.lines().size());
  // Nothing was wrong, so nothing moves but by rounding of floats.
  EXPECT_LT(pose_difference(map.pose_of(KeyframeId{1}), second.T_cw), 1e-4);
  expect_consistent(map);
}

TEST(LocalMapperLines, PullAKeyframeBackToItsPlace) {
  LineMapper m;
  // Two pixels and more beside where the lines are.
  const SE3 error = SE3::exp((Vector6d() << 0.008, -0.006, 0.01, 0.002, -0.003, 0.004).finished());
  std::vector<LineView> views;
  for (std::size_t i = 1; i <= 3; ++i) {
    const double t = static_cast<double>(i);
    views.push_back(m.world.look(camera_at({0.05 * t, 0.03 * t, 0.0}, 0.03 * t), 10 * i));
    (void)m.mapper.process(m.after_first(views.back(), error));
  }
  ASSERT_GT(pose_difference(error, SE3{}), 0.01);
  m.mapper.map().keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    // The first keyframe's lines are exact, and so is what the others show: floats are all that is left.
    if (id.value > 0) {
      EXPECT_LT(pose_difference(keyframe.T_cw, views[id.value - 1].T_cw), 1e-3);
    }
  });
  EXPECT_GE(m.mapper.map().keyframes().size(), 2U);
  expect_consistent(m.mapper.map());
}

TEST(LocalMapperLines, CountTheSightingsOfThoseThatAreStillThere) {
  LineMapper m;
  KeyframeCandidate next = m.after_first(m.world.look(m.first.T_cw, 10));
  next.line_sightings = {{LineId{3}, 5, 4}, {LineId{4}, 50, 1}};
  (void)m.mapper.process(next);
  EXPECT_EQ(m.mapper.map().lines()[LineId{3}].visible, 6);
  EXPECT_EQ(m.mapper.map().lines()[LineId{3}].found, 5);
  EXPECT_FALSE(m.mapper.map().lines().contains(LineId{4})) << "rarely found";
  // The next report may still speak of it, and the tracker have seen it.
  next.line_sightings = {{LineId{4}, 5, 5}};
  (void)m.mapper.process(next);
  EXPECT_FALSE(m.mapper.map().lines().contains(LineId{4}));
  expect_consistent(m.mapper.map());
}

TEST(LocalMapperLines, ThatNoOtherKeyframeSawDoNotStay) {
  MappingOptions options;
  options.culling.probation = 2;
  options.culling.min_observations = 2;
  LineMapper m(options);
  LineFeatures few;
  const std::size_t kept = 12;
  few.segments.assign(m.first.lines->segments.begin(), m.first.lines->segments.begin() + kept);
  few.descriptors.assign(m.first.lines->descriptors.begin(), m.first.lines->descriptors.begin() + kept);
  LineView view = m.first;
  view.lines = std::make_shared<const LineFeatures>(few);
  for (int i = 0; i < 3; ++i) (void)m.mapper.process(m.after_first(view));
  EXPECT_EQ(m.mapper.map().lines().size(), kept);
  expect_consistent(m.mapper.map());
}

TEST(LocalMapperLines, AKeyframeWithoutAnyHarmsNoOne) {
  LineMapper m;
  KeyframeCandidate blind = m.after_first(m.first);
  blind.lines = nullptr;
  const auto local = m.mapper.process(blind);
  EXPECT_EQ(m.mapper.map().lines().size(), m.first.lines->size());
  EXPECT_EQ(local->keyframes.back().id, KeyframeId{1});
  EXPECT_LT(pose_difference(m.mapper.map().pose_of(KeyframeId{1}), m.first.T_cw), 1e-12);
  expect_consistent(m.mapper.map());
}

TEST(LocalMapperLines, BuildAMapThatKeepsACameraInPlace) {
  const LineWorld world;
  TrackerOptions options;
  options.line_support = 3.0;
  options.min_inliers = 30;
  Tracker tracker(kTestCamera, kTestPyramid, kTestNoise, options);
  Mapped mapper = make_mapper();
  std::shared_ptr<const LocalMap> local;
  const LineViewOptions noisy{.pixel_noise = 0.3, .inverse_depth_noise = 0.005, .depth_share = 0.8};
  for (std::size_t i = 0; i < 30; ++i) {
    const double t = static_cast<double>(i);
    const SE3 truth = camera_at({0.006 * t, -0.003 * t, 0.004 * t}, 0.005 * t, 0.002 * t);
    const LineView view = world.look(truth, i, noisy);
    TrackedFrame tracked = tracker.track(view.frame, local, world.image(truth));
    if (i == 0) {
      local = mapper.process({.tracked = tracked, .lines = view.lines});
      tracked.state = TrackingState::kTracking;
      tracked.reference = KeyframeId{0};
      tracker.start(tracked);
    } else if (i % 5 == 0) {
      local = mapper.process({tracked, tracker.take_sightings(), tracker.take_line_sightings(), view.lines});
    }
    ASSERT_EQ(tracked.state, TrackingState::kTracking) << "frame " << i;
    // 0.005 / m of depth noise are 3 cm at 2.5 m; the average over some sixty lines, which keyframes of 18 cm
    // apart and each frame's image go on improving, is a few millimetres and milliradians.
    EXPECT_LT(pose_difference(tracked.T_cw, truth), 0.015) << "frame " << i;
  }
  EXPECT_GT(mapper.map().lines().size(), 50U);
  int seen_often = 0;
  mapper.map().lines().for_each(
      [&](LineId, const Line& line) { seen_often += line.observations.size() > 2 ? 1 : 0; });
  EXPECT_GT(seen_often, 40) << "lines should be found again, not made anew";
  expect_consistent(mapper.map());
}

}  // namespace
}  // namespace ipl_slam
