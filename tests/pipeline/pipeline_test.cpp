#include "pipeline/pipeline.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <ipl_slam/error.hpp>

#include "dataset/temporary_folder.hpp"
#include "dataset/trajectory.hpp"
#include "evaluation/absolute_error.hpp"
#include "pipeline/lines_ply.hpp"
#include "support/rendered_sequence.hpp"

namespace ipl_slam {
namespace {

using testing::content_of;
using testing::render_all;
using testing::small_camera;
using testing::small_room;
using testing::TemporaryFolder;

/// The bytes that a run over `frames` would leave.
struct Written {
  std::string trajectory, keyframes, lines;
  bool operator==(const Written&) const = default;
};

Written write_results(const Pipeline& pipeline) {
  const TemporaryFolder folder;
  write_trajectory(folder / "trajectory.txt", pipeline.trajectory());
  write_trajectory(folder / "keyframes.txt", pipeline.keyframe_trajectory());
  std::string lines;
  pipeline.mapping().read([&](const Map& map, const std::vector<MappingRecord>&) { lines = lines_ply(map); });
  return {content_of(folder / "trajectory.txt"), content_of(folder / "keyframes.txt"), lines};
}

Written run_lockstep(const std::vector<RgbdFrame>& frames, int threads, const char* lines) {
  Config config;
  config.features.lines = lines;
  config.schedule.threads = threads;
  Pipeline pipeline(small_camera(), config);
  for (const RgbdFrame& frame : frames) (void)pipeline.process(frame);
  pipeline.finish();
  return write_results(pipeline);
}

/// The states that a lockstep pipeline gives for the frames, one letter each: i, t or l.
std::string states(Pipeline& pipeline, const std::vector<RgbdFrame>& frames) {
  std::string letters;
  for (const RgbdFrame& frame : frames) {
    const TrackingState state = pipeline.process(frame).state;
    letters += state == TrackingState::kInitializing ? 'i' : state == TrackingState::kTracking ? 't' : 'l';
  }
  return letters;
}

TEST(Lockstep, GivesTheSameBytesAgainAndWithAnyNumberOfThreads) {
  const std::vector<RgbdFrame> frames = render_all(small_room(40));
  for (const char* lines : {"off", "lsd", "edges"}) {
    const Written once = run_lockstep(frames, 1, lines);
    // A map of one keyframe would prove little about the mapper.
    ASSERT_GT(std::count(once.keyframes.begin(), once.keyframes.end(), '\n'), 2) << lines;
    EXPECT_EQ(once, run_lockstep(frames, 1, lines)) << "second run, lines " << lines;
    EXPECT_EQ(once, run_lockstep(frames, 2, lines)) << "two threads, lines " << lines;
  }
}

TEST(Lockstep, IsAsRandomAsTheSeedAndTheNoiseSay) {
  const std::vector<RgbdFrame> frames = render_all(small_room(6));
  const auto trajectory = [&](std::uint64_t seed, double noise) {
    Config config;
    config.segmentation.segmenter = "none";  // sees the image without the noise
    config.schedule.seed = seed;
    config.features.noise = noise;
    Pipeline pipeline(small_camera(), config);
    for (const RgbdFrame& frame : frames) (void)pipeline.process(frame);
    EXPECT_EQ(pipeline.trajectory().size(), frames.size()) << "tracks through it";
    return write_results(pipeline).trajectory;
  };
  const std::string noisy = trajectory(1, 2.0);
  EXPECT_EQ(noisy, trajectory(1, 2.0)) << "the same seed";
  EXPECT_NE(noisy, trajectory(2, 2.0)) << "another seed";
  EXPECT_NE(noisy, trajectory(1, 0.0)) << "no noise";
}

/// What became of lines in a run over `frames`.
struct LineUse {
  std::size_t in_map = 0;
  int tracked = 0;  ///< over all frames
  std::string ply;
};

LineUse lines_of(const std::vector<RgbdFrame>& frames, const std::string& lines, const std::string& mode) {
  Config config;
  config.features.lines = lines;
  config.schedule.mode = mode;
  Pipeline pipeline(small_camera(), config);
  LineUse use;
  for (const RgbdFrame& frame : frames) use.tracked += pipeline.process(frame).lines;
  pipeline.finish();
  pipeline.mapping().read([&](const Map& map, const std::vector<MappingRecord>&) {
    use.in_map = map.lines().size();
    use.ply = lines_ply(map);
  });
  return use;
}

TEST(Lines, AreMappedAndTrackedInBothSchedulesWithBothDetectors) {
  const std::vector<RgbdFrame> frames = render_all(small_room(15));
  for (const char* mode : {"lockstep", "realtime"}) {
    for (const char* lines : {"lsd", "edges"}) {
      const LineUse use = lines_of(frames, lines, mode);
      EXPECT_GT(use.in_map, 10U) << mode << ", " << lines;
      // Of the first frame on the map shows lines; a few in each later one are little.
      EXPECT_GT(use.tracked, 3 * 14) << mode << ", " << lines;
    }
  }
}

TEST(Lines, AreNowhereWhenTheyAreOff) {
  const std::vector<RgbdFrame> frames = render_all(small_room(8));
  for (const char* mode : {"lockstep", "realtime"}) {
    const LineUse use = lines_of(frames, "off", mode);
    EXPECT_EQ(use.in_map, 0U);
    EXPECT_EQ(use.tracked, 0);
    EXPECT_NE(use.ply.find("element edge 0\n"), std::string::npos);
    EXPECT_TRUE(use.ply.ends_with("end_header\n")) << "nothing but the header";
  }
}

TEST(Lockstep, FollowsTheCameraThroughASmallRoom) {
  const SyntheticOptions options = small_room(60);
  const SyntheticSource source(options);
  Pipeline pipeline(small_camera(), {});
  EXPECT_EQ(states(pipeline, render_all(options)), std::string(60, 't'));
  Trajectory truth;
  for (std::size_t i = 0; i < 60; ++i) truth.push_back({source.timestamp(i), source.T_wc(i)});
  // The camera moves by a few decimetres at 2 m from the scene; at 320x240 a pixel is about 8 mm there, and
  // hundreds of points with a Kinect's depth noise bring the pose down to about 2 mm.
  EXPECT_LT(absolute_trajectory_error(truth, pipeline.trajectory()).rmse, 0.010);
}

TEST(Realtime, RunsToTheEndAndLosesNothing) {
  const std::vector<RgbdFrame> frames = render_all(small_room(40));
  for (int repetition = 0; repetition < 5; ++repetition) {
    Config config;
    config.schedule.mode = "realtime";
    Pipeline pipeline(small_camera(), config);
    EXPECT_EQ(states(pipeline, frames), std::string(frames.size(), 't'));
    pipeline.finish();
    EXPECT_EQ(pipeline.trajectory().size(), frames.size());
    EXPECT_GE(pipeline.keyframe_trajectory().size(), 2U);
  }
}

TEST(Realtime, CanBeAbandonedWhileTheMapperWorks) {
  const std::vector<RgbdFrame> frames = render_all(small_room(12));
  for (std::size_t after = 1; after <= frames.size(); ++after) {
    Config config;
    config.schedule.mode = "realtime";
    config.keyframes.min_interval = 0;
    Pipeline pipeline(small_camera(), config);
    for (std::size_t i = 0; i < after; ++i) (void)pipeline.process(frames[i]);
    // Destroyed here, without finish().
  }
}

TEST(Initialisation, WaitsForTheFirstFrameWithDepth) {
  std::vector<RgbdFrame> frames = render_all(small_room(12));
  for (std::size_t i = 0; i < 5; ++i) frames[i].depth.setTo(0);
  Pipeline pipeline(small_camera(), {});
  EXPECT_EQ(states(pipeline, frames), "iiiiittttttt");
  const Trajectory trajectory = pipeline.trajectory();
  ASSERT_EQ(trajectory.size(), 7U);
  EXPECT_EQ(trajectory.front().timestamp, frames[5].timestamp);
  EXPECT_TRUE(trajectory.front().T_wc.translation().isZero()) << "the first tracked frame is the origin";
}

TEST(Initialisation, NeverHappensWithoutDepth) {
  std::vector<RgbdFrame> frames = render_all(small_room(8));
  for (RgbdFrame& frame : frames) frame.depth.setTo(0);
  for (const char* mode : {"lockstep", "realtime"}) {
    Config config;
    config.schedule.mode = mode;
    Pipeline pipeline(small_camera(), config);
    EXPECT_EQ(states(pipeline, frames), "iiiiiiii") << mode;
    pipeline.finish();
    EXPECT_TRUE(pipeline.trajectory().empty());
    EXPECT_TRUE(pipeline.keyframe_trajectory().empty());
  }
}

TEST(Tracking, GoesOnAgainstTheMapWhileDepthIsAway) {
  std::vector<RgbdFrame> frames = render_all(small_room(30));
  for (std::size_t i = 15; i < 25; ++i) frames[i].depth.setTo(0);
  Pipeline pipeline(small_camera(), {});
  EXPECT_EQ(states(pipeline, frames), std::string(30, 't'));
}

TEST(Tracking, RecoversAfterTwentyBlackFrames) {
  // The camera stands still in the dark: what comes after must be placed in the same map.
  std::vector<RgbdFrame> frames = render_all(small_room(30));
  const double step = frames[1].timestamp - frames[0].timestamp;
  std::vector<RgbdFrame> shown(frames.begin(), frames.begin() + 20);
  for (int i = 0; i < 20; ++i) {
    RgbdFrame black = frames[19];
    black.color = cv::Mat(black.color.size(), black.color.type(), cv::Scalar::all(0));
    shown.push_back(std::move(black));
  }
  shown.insert(shown.end(), frames.begin() + 20, frames.end());
  for (std::size_t i = 0; i < shown.size(); ++i) {
    shown[i].index = i;
    shown[i].timestamp = static_cast<double>(i) * step;
  }
  Pipeline pipeline(small_camera(), {});
  EXPECT_EQ(states(pipeline, shown), std::string(20, 't') + std::string(20, 'l') + std::string(10, 't'));

  const SyntheticSource source(small_room(30));
  Trajectory truth;
  for (std::size_t i = 0; i < 20; ++i) truth.push_back({shown[i].timestamp, source.T_wc(i)});
  for (std::size_t i = 20; i < 30; ++i) truth.push_back({shown[i + 20].timestamp, source.T_wc(i)});
  // One map before and after: a new origin would put the frames after the gap decimetres off.
  EXPECT_LT(absolute_trajectory_error(truth, pipeline.trajectory()).max, 0.03);
}

TEST(Input, AFrameThatDoesNotComeAfterTheLastCountsAsNeverGiven) {
  const std::vector<RgbdFrame> frames = render_all(small_room(10));
  Pipeline clean(small_camera(), {}), disturbed(small_camera(), {});
  (void)states(clean, frames);
  for (const RgbdFrame& frame : frames) {
    (void)disturbed.process(frame);
    RgbdFrame wrong = frames[0];
    for (const double time :
         {frame.timestamp, frame.timestamp - 1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
      wrong.timestamp = time;
      EXPECT_THROW((void)disturbed.process(wrong), std::invalid_argument) << time;
    }
  }
  EXPECT_EQ(write_results(clean), write_results(disturbed));
}

TEST(Input, AFrameOfAnotherSizeOrTypeCountsAsNeverGiven) {
  const std::vector<RgbdFrame> frames = render_all(small_room(10));
  std::vector<RgbdFrame> wrong(5);
  wrong[0].color = cv::Mat::zeros(240, 319, CV_8UC3);
  wrong[1].depth = cv::Mat::zeros(239, 320, CV_16UC1);
  wrong[2].color = cv::Mat::zeros(240, 320, CV_16UC1);
  wrong[3].depth = cv::Mat::zeros(240, 320, CV_32FC1);
  wrong[4].color = cv::Mat::zeros(240, 320, CV_8UC4);

  Pipeline clean(small_camera(), {}), disturbed(small_camera(), {});
  (void)states(clean, frames);
  for (const RgbdFrame& frame : frames) {
    for (RgbdFrame bad : wrong) {
      bad.timestamp = frame.timestamp;
      if (bad.color.empty()) bad.color = frame.color;
      if (bad.depth.empty()) bad.depth = frame.depth;
      EXPECT_THROW((void)disturbed.process(bad), std::invalid_argument);
    }
    (void)disturbed.process(frame);
  }
  EXPECT_EQ(write_results(clean), write_results(disturbed));
}

TEST(Input, GreyImagesAreTrackedAsWell) {
  std::vector<RgbdFrame> frames = render_all(small_room(10));
  for (RgbdFrame& frame : frames) cv::extractChannel(cv::Mat(frame.color), frame.color, 1);
  Pipeline pipeline(small_camera(), {});
  EXPECT_EQ(states(pipeline, frames), "tttttttttt");
}

TEST(Settings, ThatContradictEachOtherAreRefused) {
  Config config;
  check(config);
  config.orb.fast_min_threshold = config.orb.fast_threshold + 1;
  EXPECT_NE(testing::message_of<UserError>([&] { check(config); }).find("orb.fast_min_threshold"),
            std::string::npos);
}

TEST(Settings, ThatMakeMoversAndStillThingsAlikeAreRefused) {
  Config config;
  config.dynamics.belief.moved_on_still = config.dynamics.belief.moved_on_mover;
  EXPECT_NE(testing::message_of<UserError>([&] { check(config); }).find("dynamics.belief.moved_on_still"),
            std::string::npos);
}

TEST(Settings, AskNothingOfLinesThatAreNotThere) {
  Config config = preset("paper");
  EXPECT_EQ(dynamics_options(config).lines.check, "angle");
  config.features.lines = "off";
  EXPECT_EQ(dynamics_options(config).lines.check, "off");
}

TEST(Settings, OfBothPresetsStandTogether) {
  for (const std::string& name : preset_names()) EXPECT_NO_THROW(check(preset(name))) << name;
}

}  // namespace
}  // namespace ipl_slam
