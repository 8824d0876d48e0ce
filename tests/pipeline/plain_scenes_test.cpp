// What lines are for: rooms with edges but hardly a corner.

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "evaluation/absolute_error.hpp"
#include "pipeline/pipeline.hpp"
#include "support/rendered_sequence.hpp"

namespace ipl_slam {
namespace {

struct Outcome {
  int tracked = 0;
  double rmse = 0.0;  // m
};

/// 80 frames of full size out of the middle of a walk, by a stretch that is all walls.
class PlainWalk {
 public:
  PlainWalk(const std::string& scene, std::uint64_t seed) {
    constexpr std::size_t kFirst = 150, kFrames = 80;
    SyntheticOptions options;
    options.scene = scene;
    options.trajectory = "walk";
    options.seed = seed;
    options.frames = kFirst + kFrames;
    const SyntheticSource source(options, 2);
    camera_ = source.camera();
    for (std::size_t i = kFirst; i < kFirst + kFrames; ++i) {
      frames_.push_back(source.render(i).rgbd);
      truth_.push_back({source.timestamp(i), source.T_wc(i)});
    }
  }

  [[nodiscard]] Outcome run(const char* lines) const {
    Config config;
    config.features.lines = lines;
    config.segmentation.segmenter = "none";
    Pipeline pipeline(camera_, config);
    Outcome outcome;
    for (const RgbdFrame& frame : frames_) {
      outcome.tracked += pipeline.process(frame).state == TrackingState::kTracking ? 1 : 0;
    }
    outcome.rmse = absolute_trajectory_error(truth_, pipeline.trajectory()).rmse;
    return outcome;
  }
  [[nodiscard]] int frames() const { return static_cast<int>(frames_.size()); }

 private:
  Camera camera_;
  std::vector<RgbdFrame> frames_;
  Trajectory truth_;
};

// Half the error of points alone, every frame tracked; what points did is returned. Rendering and three runs
// over 80 frames of full size take seconds.
Outcome expect_lines_to_carry_the_pose(const PlainWalk& walk) {
  const Outcome points = walk.run("off");
  for (const char* detector : {"edges", "lsd"}) {
    const Outcome lines = walk.run(detector);
    EXPECT_EQ(lines.tracked, walk.frames()) << detector;
    EXPECT_LT(lines.rmse, 0.5 * points.rmse) << detector;
    EXPECT_LT(lines.rmse, 0.012) << detector;
    ::testing::Test::RecordProperty(std::string(detector) + "_mm", std::to_string(1000.0 * lines.rmse));
  }
  ::testing::Test::RecordProperty("points_tracked", points.tracked);
  ::testing::Test::RecordProperty("points_mm", std::to_string(1000.0 * points.rmse));
  return points;
}

TEST(PlainScenes, LinesCarryThePoseThroughAWhiteRoom) {
  const PlainWalk walk("white_room", 2);
  const Outcome points = expect_lines_to_carry_the_pose(walk);
  EXPECT_LT(points.tracked, 0.8 * walk.frames()) << "there is something else to hold on to";
}

TEST(PlainScenes, LinesCarryThePoseAlongACorridor) {
  const Outcome points = expect_lines_to_carry_the_pose(PlainWalk("corridor", 1));
  EXPECT_GT(points.rmse, 0.015) << "points alone do well: this shows nothing of lines";
}

}  // namespace
}  // namespace ipl_slam
