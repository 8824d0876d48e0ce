// The whole system in the situations that break systems which trust masks alone, or motion alone. A comment
// gives the ATE measured without segmentation and with the true masks; the same path through the room with
// nobody in it gives 4 mm, turning on the spot 2 mm. Bounds are about twice what was measured.

#include <cmath>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "evaluation/absolute_error.hpp"
#include "pipeline/pipeline.hpp"
#include "support/recorded_story.hpp"

namespace ipl_slam {
namespace {

using testing::RecordedStory;
using testing::TemporaryFolder;

constexpr int kFrames = 60;

// Five seconds in few and small frames, so that rendering and two runs take seconds. Printed clothes: people
// hold as many corners as the room does.
SyntheticOptions story(const char* name, int people, const char* trajectory = "halfsphere") {
  SyntheticOptions options = testing::small_room(kFrames, trajectory);
  options.fps = 12.0;
  options.story = name;
  options.clothes = "printed";
  options.people = people;
  options.boxes = options.story == "push" ? 1 : 0;
  return options;
}

// Four people cover 55 to 65 %. What is left of the room in a smaller picture, or beside people whose
// clothes win the contest for corners, is too little for any method.
SyntheticOptions crowd(const char* trajectory) {
  SyntheticOptions options = story("crowd", 4, trajectory);
  options.width = 480;
  options.height = 360;
  options.clothes = "plain";
  options.fps = 30.0;  // in two seconds
  return options;
}

struct Outcome {
  int tracked = 0;
  double rmse = 0.0;   // m
  int on_actors = 0;   // points that agree with the pose, on people or other actors, of all frames
  int late_masks = 0;  // frames with masks made from an earlier picture
  bool last_tracked = false;
};

bool on_an_actor(const cv::Mat& labels, const Eigen::Vector2f& pixel) {
  return labels.at<std::uint8_t>(static_cast<int>(std::lround(pixel.y())),
                                 static_cast<int>(std::lround(pixel.x()))) != 0;
}

Outcome run(const char* name, const RecordedStory& story, const Config& config) {
  Pipeline pipeline(story.camera(), config);
  Outcome outcome;
  for (std::size_t i = 0; i < story.size(); ++i) {
    const FrameResult result = pipeline.process(story.frames()[i]);
    outcome.last_tracked = result.state == TrackingState::kTracking;
    outcome.tracked += outcome.last_tracked ? 1 : 0;
    outcome.late_masks += result.mask_age > 0 ? 1 : 0;
    const TrackedFrame& frame = pipeline.last_tracked();
    for (std::size_t k = 0; k < frame.points.size(); ++k) {
      if (!frame.points[k].valid()) continue;
      outcome.on_actors += on_an_actor(story.labels()[i], frame.frame->features.keypoints[k].pixel) ? 1 : 0;
    }
  }
  pipeline.finish();
  outcome.rmse = absolute_trajectory_error(story.truth(), pipeline.trajectory()).rmse;
  ::testing::Test::RecordProperty(
      name, fmt::format("{:.1f} mm, {} tracked, {} points on actors, {} late masks", 1000.0 * outcome.rmse,
                        outcome.tracked, outcome.on_actors, outcome.late_masks));
  return outcome;
}

Outcome run_untreated(const RecordedStory& story) {
  Config config;
  config.segmentation.segmenter = "none";
  return run("untreated", story, config);
}

Outcome run_geometric(const RecordedStory& story) {
  Config config;
  config.segmentation.segmenter = "geometric";
  return run("geometric", story, config);
}

Outcome run_with_masks(const RecordedStory& story, const RecordedStory::Spoil& spoil = {},
                       const char* mode = "lockstep") {
  const TemporaryFolder folder;
  story.write_masks(folder, spoil);
  Config config;
  config.schedule.mode = mode;
  config.segmentation.segmenter = "masks";
  config.segmentation.masks.folder = folder.path().string();
  return run("masks", story, config);
}

// 102 mm, 11 mm.
TEST(DynamicsScenarios, ACrowdOverMoreThanHalfOfThePicture) {
  const RecordedStory story(crowd("halfsphere"));
  ASSERT_GT(story.covered(), 0.55);
  const Outcome untreated = run_untreated(story), treated = run_with_masks(story);
  EXPECT_GE(treated.tracked, kFrames - 4);
  EXPECT_LT(treated.rmse, 0.025);
  EXPECT_LT(treated.rmse, 0.7 * untreated.rmse);
}

// 29 mm, 5 mm.
TEST(DynamicsScenarios, ACrowdBeforeACameraThatOnlyTurns) {
  SyntheticOptions turning = crowd("rpy");
  turning.fps = 12.0;  // in the first two seconds alone hardly anything but people is in sight
  const RecordedStory story(turning);
  ASSERT_GT(story.covered(), 0.55);
  const Outcome untreated = run_untreated(story), treated = run_with_masks(story);
  EXPECT_GE(treated.tracked, kFrames - 4);
  EXPECT_LT(treated.rmse, 0.02);
  EXPECT_LT(treated.rmse, 0.5 * untreated.rmse);
}

// 61 mm, 11 mm, more than 60 % covered.
TEST(DynamicsScenarios, ACrowdBeforeACameraThatStandsStill) {
  const RecordedStory story(crowd("static"));
  ASSERT_GT(story.covered(), 0.6);
  const Outcome untreated = run_untreated(story), treated = run_with_masks(story);
  EXPECT_GE(treated.tracked, kFrames - 4);
  EXPECT_LT(treated.rmse, 0.012);
  EXPECT_LT(treated.rmse, 0.5 * untreated.rmse);
}

// 2 mm, 4 mm: what is removed until everybody is known to stand still costs a little.
TEST(DynamicsScenarios, FeaturesOfPeopleWhoStandStillAreKept) {
  const RecordedStory story(ipl_slam::story("stand", 4));
  const Outcome nothing_removed = run_untreated(story), treated = run_with_masks(story);
  ASSERT_GT(nothing_removed.on_actors, 100 * kFrames) << "what the test is about";
  EXPECT_GT(treated.on_actors, 0.8 * nothing_removed.on_actors);
  EXPECT_EQ(treated.tracked, kFrames);
  EXPECT_LT(treated.rmse, 0.008);
}

// 89 mm, 5 mm; geometric 5 mm.
TEST(DynamicsScenarios, PeopleEnterARoomThatIsKnown) {
  const RecordedStory story(ipl_slam::story("enter", 3));
  const Outcome untreated = run_untreated(story);
  for (const Outcome& treated : {run_with_masks(story), run_geometric(story)}) {
    EXPECT_EQ(treated.tracked, kFrames);
    EXPECT_LT(treated.rmse, 0.012);
    EXPECT_LT(treated.rmse, 0.3 * untreated.rmse);
  }
}

// 128 mm, 20 mm; geometric 23 mm.
TEST(DynamicsScenarios, PeopleWhoStoodStillLeave) {
  const RecordedStory story(ipl_slam::story("leave", 3));
  const Outcome untreated = run_untreated(story);
  for (const Outcome& treated : {run_with_masks(story), run_geometric(story)}) {
    EXPECT_EQ(treated.tracked, kFrames);
    EXPECT_LT(treated.rmse, 0.035);
    EXPECT_LT(treated.rmse, 0.3 * untreated.rmse);
  }
}

// 89 mm, 4 mm: the tracks carry over.
TEST(DynamicsScenarios, TheSegmenterMissesPeopleForSomeFrames) {
  const RecordedStory story(ipl_slam::story("enter", 3));
  const Outcome untreated = run_untreated(story);
  const Outcome treated = run_with_masks(story, [](std::size_t frame, cv::Mat& labels) {
    if (frame % 10 >= 6) labels.setTo(0);  // four frames of ten
  });
  EXPECT_EQ(treated.tracked, kFrames);
  EXPECT_LT(treated.rmse, 0.3 * untreated.rmse);
}

// 5 mm. For twelve frames one "person" covers the whole picture.
TEST(DynamicsScenarios, NothingIsLeftOutsideThePeopleForASecond) {
  const RecordedStory story(ipl_slam::story("enter", 3));
  const Outcome treated = run_with_masks(story, [&](std::size_t frame, cv::Mat& labels) {
    if (frame >= 20 && frame < 32) labels.setTo(story.actors().front().id);
  });
  EXPECT_TRUE(treated.last_tracked);
  EXPECT_GE(treated.tracked, kFrames - 12);
  EXPECT_LT(treated.rmse, 0.012);
}

// 89 mm, 5 mm. Frames come as fast as they are tracked: the masks are always some frames behind.
TEST(DynamicsScenarios, MasksComeLateInRealtime) {
  const RecordedStory story(ipl_slam::story("enter", 3));
  const Outcome untreated = run_untreated(story), treated = run_with_masks(story, {}, "realtime");
  EXPECT_GT(treated.late_masks, 0);
  EXPECT_EQ(treated.tracked, kFrames);
  EXPECT_LT(treated.rmse, 0.5 * untreated.rmse);
}

// 284 mm without segmentation, 11 mm with masks, 130 mm with the geometric segmenter.
TEST(DynamicsScenarios, AThingOfNoKnownClassThatStoodStillMoves) {
  const RecordedStory story(ipl_slam::story("push", 0));
  const Outcome untreated = run_untreated(story), by_class = run_with_masks(story),
                geometric = run_geometric(story);
  EXPECT_EQ(by_class.tracked, kFrames);
  EXPECT_LT(by_class.rmse, 0.1 * untreated.rmse);
  // A quarter of the picture, near and full of corners: the geometric segmenter takes its motion for the
  // camera's for a while.
  EXPECT_EQ(geometric.tracked, kFrames);
  EXPECT_LT(geometric.rmse, 0.7 * untreated.rmse);
}

}  // namespace
}  // namespace ipl_slam
