#include <chrono>
#include <thread>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "pipeline/realtime_mapping.hpp"
#include "support/candidate.hpp"
#include "support/map_checks.hpp"
#include "support/rendered_sequence.hpp"
#include "support/synthetic_world.hpp"

namespace ipl_slam {
namespace {

using test::expect_consistent;
using testing::small_camera;
using testing::small_room;

MapKeeper keeper() {
  return {small_camera(), Config{}};
}

KeyframeLines keyframe_lines() {
  return {LineExtractor(LineMethod::kEdges, LineOptions{}, small_camera(), DepthNoiseOptions{}),
          LineMotionCheck(small_camera(), LineMotionOptions{}), 0.2};
}

// Frames of the room as keyframes at their true poses, without keypoints: what the map gets is lines.
std::vector<NewKeyframe> keyframes(int count) {
  SyntheticSource source(small_room(count));
  std::vector<NewKeyframe> result;
  const auto walk = testing::render_all(small_room(count));
  for (std::size_t i = 0; i < walk.size(); ++i) {
    NewKeyframe keyframe;
    TrackedFrame& tracked = keyframe.candidate.tracked;
    tracked.frame = test::SyntheticWorld::make_frame({}, i);
    tracked.state = TrackingState::kTracking;
    tracked.T_cw = source.T_wc(i).inverse();
    if (i > 0) {
      tracked.reference = KeyframeId{0};
      tracked.T_c_reference = tracked.T_cw * source.T_wc(0);
    }
    cv::cvtColor(walk[i].color, keyframe.grey, cv::COLOR_BGR2GRAY);
    keyframe.depth = walk[i].depth;
    result.push_back(std::move(keyframe));
  }
  return result;
}

std::vector<std::unique_ptr<MappingSchedule>> both_schedules(bool with_lines = true) {
  const auto lines = [&] { return with_lines ? std::optional(keyframe_lines()) : std::nullopt; };
  std::vector<std::unique_ptr<MappingSchedule>> schedules;
  schedules.push_back(make_lockstep_mapping(keeper(), lines()));
  schedules.push_back(make_realtime_mapping(keeper(), lines(), 2));
  return schedules;
}

TEST(MappingSchedule, TheFirstLocalMapHasTheLinesOfTheFirstKeyframe) {
  const NewKeyframe first = keyframes(1)[0];
  for (const auto& schedule : both_schedules()) {
    EXPECT_FALSE(schedule->local_map());
    schedule->start(first);
    ASSERT_TRUE(schedule->local_map());
    EXPECT_GT(schedule->local_map()->lines.size(), 10U);
  }
}

TEST(MappingSchedule, FinishWaitsUntilTheLinesOfAllKeyframesAreInTheMap) {
  const std::vector<NewKeyframe> walk = keyframes(6);
  for (const auto& schedule : both_schedules()) {
    schedule->start(walk[0]);
    for (std::size_t i = 1; i < walk.size(); ++i) schedule->submit(walk[i]);
    schedule->finish();
    EXPECT_TRUE(schedule->idle());
    EXPECT_EQ(schedule->local_map()->keyframes.back().id, KeyframeId{5});
    schedule->read([&](const Map& map, const std::vector<MappingRecord>& times) {
      expect_consistent(map);
      ASSERT_EQ(times.size(), walk.size());
      for (std::size_t i = 0; i < times.size(); ++i) {
        EXPECT_EQ(times[i].frame_index, i) << "in the order they were submitted";
        EXPECT_GT(times[i].lines, 0.0);
        EXPECT_GT(times[i].mapping, 0.0);
      }
      map.keyframes().for_each([](KeyframeId id, const Keyframe& keyframe) {
        EXPECT_GT(keyframe.line_features->size(), 10U) << "keyframe " << id.value;
      });
      EXPECT_GT(map.lines().size(), 10U);
    });
  }
}

TEST(MappingSchedule, LinesThatAreThereAreNotExtractedAgain) {
  NewKeyframe keyframe = keyframes(1)[0];
  const auto lines = std::make_shared<const LineFeatures>();
  keyframe.candidate.lines = lines;
  keyframe.grey = cv::Mat::zeros(10, 10, CV_8UC1);  // not of the camera's size: it could not be done
  for (const auto& schedule : both_schedules()) {
    EXPECT_NO_THROW(schedule->start(keyframe));
    schedule->read([&](const Map& map, const std::vector<MappingRecord>&) {
      EXPECT_EQ(map.keyframes()[KeyframeId{0}].line_features, lines);
    });
  }
}

TEST(MappingSchedule, WithoutAnExtractorThereAreNoLines) {
  const std::vector<NewKeyframe> walk = keyframes(2);
  for (const auto& schedule : both_schedules(false)) {
    schedule->start(walk[0]);
    schedule->submit(walk[1]);
    schedule->finish();
    schedule->read([](const Map& map, const std::vector<MappingRecord>& times) {
      EXPECT_EQ(map.keyframes().size(), 2U);
      EXPECT_EQ(map.lines().size(), 0U);
      for (const MappingRecord& time : times) EXPECT_EQ(time.lines, 0.0);
    });
  }
}

// A keyframe whose lines cannot be extracted: its image is not of the camera's size.
NewKeyframe broken(NewKeyframe keyframe) {
  keyframe.grey = cv::Mat::zeros(10, 10, CV_8UC1);
  return keyframe;
}

bool has_failed(const MappingSchedule& schedule) {
  try {
    (void)schedule.local_map();
    return false;
  } catch (const std::exception&) {
    return true;
  }
}

TEST(RealtimeMapping, LinesAreExtractedWhileTheMapperIsHeldUp) {
  const std::vector<NewKeyframe> walk = keyframes(3);
  const auto schedule = make_realtime_mapping(keeper(), keyframe_lines(), 3);
  schedule->start(walk[0]);
  // The mapper rests while the map is read: that the second keyframe fails can come from the line thread
  // only.
  schedule->read([&](const Map&, const std::vector<MappingRecord>&) {
    schedule->submit(walk[1]);
    schedule->submit(broken(walk[2]));
    // Generous: what is waited for takes milliseconds.
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!has_failed(*schedule) && std::chrono::steady_clock::now() < give_up) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    EXPECT_TRUE(has_failed(*schedule));
  });
}

TEST(RealtimeMapping, AsManyKeyframesWaitAsAreAllowed) {
  const std::vector<NewKeyframe> walk = keyframes(5);
  const auto schedule = make_realtime_mapping(keeper(), keyframe_lines(), 2);
  schedule->start(walk[0]);
  schedule->read([&](const Map&, const std::vector<MappingRecord>&) {
    for (std::size_t i = 1; i <= 3; ++i) {  // one is worked on, two wait
      EXPECT_TRUE(schedule->has_room());
      schedule->submit(walk[i]);
    }
    EXPECT_FALSE(schedule->has_room());
    EXPECT_FALSE(schedule->idle());
  });
  schedule->finish();
  EXPECT_TRUE(schedule->has_room());
  schedule->submit(walk[4]);
  schedule->finish();
  schedule->read([&](const Map& map, const std::vector<MappingRecord>& times) {
    EXPECT_EQ(times.size(), walk.size());
    EXPECT_GT(map.lines().size(), 10U);
  });
}

TEST(RealtimeMapping, AFailureToExtractLinesReachesTheCaller) {
  const std::vector<NewKeyframe> walk = keyframes(2);
  const auto schedule = make_realtime_mapping(keeper(), keyframe_lines(), 2);
  schedule->start(walk[0]);
  schedule->submit(broken(walk[1]));
  EXPECT_THROW(schedule->finish(), std::exception);
  EXPECT_THROW((void)schedule->local_map(), std::exception);
  EXPECT_THROW(schedule->submit(walk[1]), std::exception);
}

TEST(RealtimeMapping, WhatComesAfterAFailureIsNotMapped) {
  const std::vector<NewKeyframe> walk = keyframes(3);
  const auto schedule = make_realtime_mapping(keeper(), keyframe_lines(), 2);
  schedule->start(walk[0]);
  schedule->read([&](const Map&, const std::vector<MappingRecord>&) {
    schedule->submit(broken(walk[1]));
    try {
      schedule->submit(walk[2]);  // before the failure is known, or refused after it
    } catch (const std::exception&) {
    }
  });
  EXPECT_THROW(schedule->finish(), std::exception);
  schedule->read([&](const Map& map, const std::vector<MappingRecord>& times) {
    EXPECT_EQ(times.size(), 1U) << "the third keyframe would have got the second one's number";
    EXPECT_EQ(map.keyframes().size(), 1U);
  });
}

// Schedules whose camera walks among points, without lines.
std::vector<std::unique_ptr<MappingSchedule>> schedules_of_points(const std::optional<Map>& loaded = {}) {
  Config config;
  config.depth = test::kTestNoise;
  const auto keeper = [&] { return MapKeeper(test::kTestCamera, config, loaded); };
  std::vector<std::unique_ptr<MappingSchedule>> schedules;
  schedules.push_back(make_lockstep_mapping(keeper(), std::nullopt));
  schedules.push_back(make_realtime_mapping(keeper(), std::nullopt, 3));
  return schedules;
}

constexpr double kElsewhere = test::KeyframeWalk::kElsewhere;

void step(MappingSchedule& schedule, test::KeyframeWalk& walk, const test::View& view,
          const SE3& error = {}) {
  KeyframeCandidate next;
  schedule.read(
      [&](const Map& map, const std::vector<MappingRecord>&) { next = walk.step(view, map, error); });
  schedule.submit({.candidate = next, .grey = {}, .depth = {}});
}

// Three views of a place, the first one of all being the map's first.
void visit(MappingSchedule& schedule, test::KeyframeWalk& walk, double degrees, const SE3& error = {}) {
  for (int i = 0; i < 3; ++i) {
    const test::View view = walk.look(degrees, i);
    if (!schedule.local_map()) {
      schedule.start({.candidate = walk.start(view), .grey = {}, .depth = {}});
    } else {
      step(schedule, walk, view, i == 0 ? error : SE3{});
    }
    schedule.finish();
  }
}

// The place of a lost frame; in realtime the answer comes when it is asked for again.
std::optional<FoundPlace> place_of(MappingSchedule& schedule, const test::View& view) {
  auto place = schedule.find_place(test::lost_frame(view));
  schedule.finish();
  return place ? place : schedule.find_place(test::lost_frame(view));
}

TEST(MappingSchedule, FindsThePlaceOfALostFrame) {
  for (const auto& schedule : schedules_of_points()) {
    test::KeyframeWalk walk;
    visit(*schedule, walk, 0.0);
    visit(*schedule, walk, kElsewhere);
    const auto before = schedule->local_map();
    EXPECT_FALSE(place_of(*schedule, walk.look(2.0 * kElsewhere, 0))) << "nobody knows that place";
    const test::View view = walk.look(0.0, 1);
    schedule->finish();
    const auto place = place_of(*schedule, view);
    ASSERT_TRUE(place);
    EXPECT_EQ(schedule->local_map(), before) << "nobody has said that it is of use";
    EXPECT_TRUE(schedule->events().empty());
    schedule->resume_at(*place);
    const auto local = schedule->local_map();
    ASSERT_TRUE(local->found);
    EXPECT_LT(test::pose_difference(*local->found, view.T_cw), 0.01);
    EXPECT_LT(local->centre, KeyframeId{3});
    ASSERT_EQ(schedule->events().size(), 1U);
    EXPECT_EQ(schedule->events()[0].kind, PlaceEvent::Kind::kRelocalized);
  }
}

TEST(MappingSchedule, ALocalMapAroundAnotherKeyframeFollowsWhenItIsAskedFor) {
  for (const auto& schedule : schedules_of_points()) {
    test::KeyframeWalk walk;
    visit(*schedule, walk, 0.0);
    visit(*schedule, walk, kElsewhere);
    ASSERT_EQ(schedule->local_map()->centre, KeyframeId{5});
    schedule->move_to(KeyframeId{1});
    schedule->finish();
    EXPECT_EQ(schedule->local_map()->centre, KeyframeId{1});
    EXPECT_FALSE(schedule->local_map()->found);
    EXPECT_TRUE(schedule->events().empty());
  }
}

TEST(MappingSchedule, AfterFinishALoopIsClosedAndSettled) {
  for (const auto& schedule : schedules_of_points()) {
    test::KeyframeWalk walk;
    visit(*schedule, walk, 0.0);
    visit(*schedule, walk, kElsewhere, SE3(Eigen::Quaterniond::Identity(), {0.15, 0.0, 0.0}));
    visit(*schedule, walk, 0.0);
    ASSERT_EQ(schedule->events().size(), 1U);
    EXPECT_EQ(schedule->events()[0].kind, PlaceEvent::Kind::kLoop);
    EXPECT_EQ(schedule->local_map()->corrections, 2) << "the loop and the global bundle adjustment";
    EXPECT_EQ(schedule->local_map()->centre, KeyframeId{8});
    schedule->read([](const Map& map, const std::vector<MappingRecord>& records) {
      EXPECT_EQ(records.size(), 9U);
      EXPECT_LT(test::pose_difference(map.pose_of(KeyframeId{8}), test::KeyframeWalk::pose(0.0, 2)), 0.01);
      expect_consistent(map);
    });
  }
}

TEST(MappingSchedule, WithALoadedMapThereIsALocalMapFromTheBeginning) {
  test::KeyframeWalk walk;
  std::optional<Map> loaded;
  const auto first = std::move(schedules_of_points().front());
  visit(*first, walk, 0.0);
  first->read([&](const Map& map, const std::vector<MappingRecord>&) { loaded = map; });
  for (const auto& schedule : schedules_of_points(loaded)) {
    ASSERT_TRUE(schedule->local_map());
    EXPECT_EQ(schedule->local_map()->centre, KeyframeId{2});
    EXPECT_TRUE(place_of(*schedule, walk.look(0.0, 1)));
  }
}

TEST(RealtimeMapping, OneLostFrameIsLookedForAtATime) {
  const auto schedule = std::move(schedules_of_points().back());
  test::KeyframeWalk walk;
  visit(*schedule, walk, 0.0);
  const TrackedFrame first = test::lost_frame(walk.look(0.0, 0));
  // While the map is read no search comes to its end: the second frame finds one under way.
  schedule->read([&](const Map&, const std::vector<MappingRecord>&) {
    EXPECT_FALSE(schedule->find_place(first));
    EXPECT_FALSE(schedule->find_place(test::lost_frame(walk.look(0.0, 1))));
  });
  schedule->finish();
  const auto place = schedule->find_place(test::lost_frame(walk.look(0.0, 2)));
  ASSERT_TRUE(place);
  EXPECT_EQ(place->event.frame_index, first.frame->index);
}

TEST(RealtimeMapping, CanBeAbandonedWhileALoopIsSettled) {
  for (const bool search : {false, true}) {
    const auto schedule = std::move(schedules_of_points().back());
    test::KeyframeWalk walk;
    visit(*schedule, walk, 0.0);
    visit(*schedule, walk, kElsewhere, SE3(Eigen::Quaterniond::Identity(), {0.15, 0.0, 0.0}));
    for (int i = 0; i < 2; ++i) {
      step(*schedule, walk, walk.look(0.0, i));
      schedule->finish();
    }
    step(*schedule, walk, walk.look(0.0, 2));  // closes the loop
    if (search) (void)schedule->find_place(test::lost_frame(walk.look(0.0, 1)));
    // Destroyed here, without finish().
  }
}

TEST(RealtimeMapping, CanBeAbandonedWhileLinesAreExtracted) {
  const std::vector<NewKeyframe> walk = keyframes(4);
  for (std::size_t after = 1; after <= walk.size(); ++after) {
    const auto schedule = make_realtime_mapping(keeper(), keyframe_lines(), 4);
    schedule->start(walk[0]);
    for (std::size_t i = 1; i < after; ++i) schedule->submit(walk[i]);
    // Destroyed here, without finish().
  }
}

}  // namespace
}  // namespace ipl_slam
