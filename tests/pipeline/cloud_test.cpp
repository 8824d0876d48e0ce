// The cloud of whole runs: how true it is, and who is not in it.

#include <cmath>
#include <cstdint>

#include <gtest/gtest.h>

#include "dense/cloud_file.hpp"
#include "evaluation/cloud_error.hpp"
#include "pipeline/pipeline.hpp"
#include "support/rendered_sequence.hpp"

namespace ipl_slam {
namespace {

/// A rendered walk with everything that is known about it.
class Walk {
 public:
  explicit Walk(const SyntheticOptions& options)
      : source_(options, 2), truth_(source_.camera(), kMaxDepth, true) {
    for (std::size_t i = 0; i < source_.size(); ++i) {
      SyntheticFrame frame = source_.render(i);
      cv::Mat moving = cv::Mat::zeros(frame.mask.size(), CV_8UC1);
      for (const SyntheticObject& object : source_.objects()) {
        if (object.class_name == "person") moving |= frame.mask == object.id;
      }
      cv::Mat raw;
      frame.true_depth.convertTo(raw, CV_16UC1, source_.camera().depth_scale);
      raw.setTo(0, frame.rgbd.depth == 0);  // not seen
      if (i % 3 == 0) truth_.add(raw, moving, frame.T_wc);
      poses_.push_back({frame.rgbd.timestamp, frame.T_wc});
      frames_.push_back(std::move(frame.rgbd));
    }
  }

  struct Outcome {
    CloudError error;
    DenseMap::Result fused;
    std::size_t keyframes = 0;
  };
  [[nodiscard]] Outcome run(const Config& config) const {
    Pipeline pipeline(source_.camera(), config);
    for (const RgbdFrame& frame : frames_) (void)pipeline.process(frame);
    pipeline.finish();
    Outcome outcome{.error = {}, .fused = pipeline.fuse(), .keyframes = pipeline.dense()->dense().size()};
    outcome.error = truth_.compare(outcome.fused.cloud, align_poses(poses_, pipeline.trajectory()));
    return outcome;
  }

 private:
  static constexpr double kMaxDepth = 4.0;  // as fused (dense.range.max_depth)

  SyntheticSource source_;
  CloudTruth truth_;
  std::vector<RgbdFrame> frames_;
  Trajectory poses_;
};

Config without_segmenter() {
  Config config;
  config.segmentation.segmenter = "none";
  return config;
}

// Frames of full size, as accuracy depends on it; rendering takes seconds.
SyntheticOptions full_size(int frames, const char* trajectory) {
  SyntheticOptions options;
  options.trajectory = trajectory;
  options.frames = frames;
  options.fps = 12.0;
  return options;
}

TEST(Cloud, OfARoomIsTrueToMillimetresAndWhole) {
  const Walk::Outcome outcome = Walk(full_size(48, "halfsphere")).run(without_segmenter());
  EXPECT_LT(outcome.error.mean, 0.008);
  EXPECT_GT(outcome.error.completeness, 0.95);
  EXPECT_LT(outcome.error.far, 0.0005);
  RecordProperty("mean_mm", std::to_string(1000.0 * outcome.error.mean));
  RecordProperty("completeness", std::to_string(outcome.error.completeness));
}

// Nobody tells who they are: two seconds of standing make a ghost in every keyframe until they leave, and
// what is behind them is seen through the place where they stood.
TEST(Cloud, ForgetsSomebodyWhoStoodForTwoSecondsAndLeft) {
  SyntheticOptions options = full_size(96, "halfsphere");
  options.story = "leave";
  options.people = 1;
  const Walk walk(options);
  const Walk::Outcome carved = walk.run(without_segmenter());
  EXPECT_EQ(carved.error.ghosts, 0.0);

  Config config = without_segmenter();
  config.dense.surface.carve = 1e6;
  EXPECT_GT(walk.run(config).error.ghosts, 0.005) << "there was a ghost to be carved away";
}

TEST(Cloud, IsTheSameBytesTwice) {
  const Walk walk(testing::small_room(40, "xyz"));
  const auto bytes = [&](int threads) {
    Config config = without_segmenter();
    config.schedule.threads = threads;
    return cloud_ply(walk.run(config).fused.cloud, CloudColors::kImage);
  };
  EXPECT_EQ(bytes(1), bytes(2));
}

TEST(Cloud, InRealtimeIsOfTheSameRoom) {
  const Walk walk(testing::small_room(40, "xyz"));
  Config config = without_segmenter();
  config.schedule.mode = "realtime";
  const Walk::Outcome outcome = walk.run(config);
  EXPECT_GT(outcome.keyframes, 0U);
  EXPECT_GT(outcome.fused.cloud.points.size(), 5000U);
  EXPECT_LT(outcome.error.mean, 0.015);
}

TEST(Cloud, IsNotMadeWhereNobodyWantsIt) {
  Config config = without_segmenter();
  config.dense.enabled = false;
  const Pipeline pipeline(testing::small_camera(), config);
  EXPECT_EQ(pipeline.dense(), nullptr);
}

}  // namespace
}  // namespace ipl_slam
