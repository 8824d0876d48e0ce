// The cloud of whole runs: how true it is, and who is not in it.

#include <cstdint>
#include <map>
#include <memory>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "dataset/temporary_folder.hpp"
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
    const std::unique_ptr<Pipeline> pipeline = track(config);
    Outcome outcome{.error = {}, .fused = pipeline->fuse(), .keyframes = pipeline->dense()->dense().size()};
    outcome.error = error(*pipeline, outcome.fused);
    return outcome;
  }
  /// All frames processed, and nothing fused yet.
  [[nodiscard]] std::unique_ptr<Pipeline> track(const Config& config) const {
    auto pipeline = std::make_unique<Pipeline>(source_.camera(), config);
    for (const RgbdFrame& frame : frames_) (void)pipeline->process(frame);
    pipeline->finish();
    return pipeline;
  }
  [[nodiscard]] CloudError error(const Pipeline& pipeline, const DenseMap::Result& fused) const {
    return truth_.compare(fused.cloud, align_poses(poses_, pipeline.trajectory()));
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

// A walk of four seconds, with frames of full size, as accuracy depends on it.
TEST(Cloud, OfARoomIsTrueToMillimetresAndWhole) {
  SyntheticOptions options;
  options.trajectory = "halfsphere";
  options.frames = 32;
  options.fps = 8.0;
  const Walk::Outcome outcome = Walk(options).run(without_segmenter());
  EXPECT_LT(outcome.error.mean, 0.008);
  EXPECT_GT(outcome.error.completeness, 0.95);
  EXPECT_LT(outcome.error.far, 0.0005);
  RecordProperty("mean_mm", std::to_string(1000.0 * outcome.error.mean));
  RecordProperty("completeness", std::to_string(outcome.error.completeness));
}

/// A dense map of the views of another, taken in at once as they stand in its volume now.
std::unique_ptr<DenseMap> rebuilt(const DenseMap& dense, const Camera& camera, const DenseOptions& options) {
  const testing::TemporaryFolder folder;
  KeptKeyframes kept;
  std::map<KeyframeId, ViewSituation> situations;
  for (const KeyframeId id : dense.views().ids()) {
    const ViewSituation* situation = dense.in_volume(id);
    if (situation == nullptr) continue;
    situations.emplace(KeyframeId{static_cast<std::uint32_t>(kept.size())}, *situation);
    kept.emplace(id, KeptKeyframe{});
  }
  write_keyframe_folder(folder.path(), dense.views(), kept, camera);
  auto fresh = std::make_unique<DenseMap>(camera, options);
  (void)fresh->add(folder.path());
  (void)fresh->follow(situations);
  return fresh;
}

// Nobody tells who they are: two seconds of standing make a ghost in every keyframe until they leave, and
// what is behind them is seen through the place where they stood.
TEST(Cloud, ForgetsSomebodyWhoStoodForTwoSecondsAndLeft) {
  SyntheticOptions options = testing::small_room(64);
  options.fps = 8.0;
  options.story = "leave";
  options.people = 1;
  const Walk walk(options);
  const Config config = without_segmenter();
  const std::unique_ptr<Pipeline> pipeline = walk.track(config);
  EXPECT_EQ(walk.error(*pipeline, pipeline->fuse()).ghosts, 0.0);

  DenseOptions uncarved = config.dense;
  uncarved.surface.carve = 1e6;
  const auto with_ghost = rebuilt(pipeline->dense()->dense(), pipeline->camera(), uncarved);
  EXPECT_GT(walk.error(*pipeline, with_ghost->cloud()).ghosts, 0.05) << "there was a ghost to be carved away";
}

TEST(Cloud, IsTheSameBytesTwice) {
  const Walk walk(testing::small_room(24, "xyz"));
  const auto bytes = [&](int threads) {
    Config config = without_segmenter();
    config.schedule.threads = threads;
    return cloud_ply(walk.run(config).fused.cloud, CloudColors::kImage);
  };
  EXPECT_TRUE(bytes(1) == bytes(2));
}

TEST(Cloud, InRealtimeIsOfTheSameRoom) {
  const Walk walk(testing::small_room(24, "xyz"));
  Config config = without_segmenter();
  config.schedule.mode = "realtime";
  const Walk::Outcome outcome = walk.run(config);
  EXPECT_GT(outcome.keyframes, 0U);
  EXPECT_GT(outcome.fused.cloud.points.size(), 5000U);
  EXPECT_LT(outcome.error.mean, 0.015);
  EXPECT_LT(outcome.error.far, 0.01);
  EXPECT_GT(outcome.error.completeness, 0.9);
}

// Bundle adjustment goes on moving keyframes that are in the volume already: they are taken out of it and in
// again, some at a time. What is left in the end must not tell.
TEST(Cloud, InRealtimeIsThatOfTheFinalPosesToTheByte) {
  const Walk walk(testing::small_room(24, "xyz"));
  Config config = without_segmenter();
  config.schedule.mode = "realtime";
  config.dense.tolerance = 0.0;
  const std::unique_ptr<Pipeline> pipeline = walk.track(config);
  const DenseMap::Result fused = pipeline->fuse();
  const DenseMap& dense = pipeline->dense()->dense();
  ASSERT_GT(dense.size(), 2U);
  for (const StampedPose& keyframe : pipeline->keyframe_trajectory()) {
    for (const KeyframeId id : dense.views().ids()) {
      if (dense.views().timestamp(id) != keyframe.timestamp) continue;
      ASSERT_NE(dense.in_volume(id), nullptr);
      const SE3 difference = dense.in_volume(id)->T_cw * keyframe.T_wc;
      // Two inversions of a pose apart.
      EXPECT_LT(difference.translation().norm() + difference.angle(), 1e-6) << keyframe.timestamp;
    }
  }
  const DenseMap::Result again = rebuilt(dense, pipeline->camera(), config.dense)->cloud();
  EXPECT_TRUE(cloud_ply(fused.cloud) == cloud_ply(again.cloud));
  EXPECT_EQ(objects_json(fused.objects, fused.cloud.classes).dump(),
            objects_json(again.objects, again.cloud.classes).dump());
}

// The same with the poses a run really goes through, one keyframe at a time: nothing is begun anew, so what
// the volume went through would show.
TEST(Cloud, ThatFollowedEveryPoseIsThatOfTheFinalPosesToTheByte) {
  const Config config = without_segmenter();
  const std::vector<RgbdFrame> frames = testing::render_all(testing::small_room(40, "xyz"));
  Pipeline pipeline(testing::small_camera(), config);
  DenseMap live(testing::small_camera(), config.dense);
  const auto situations = [&] {
    std::map<KeyframeId, ViewSituation> wanted;
    pipeline.mapping().read([&](const Map& map, const std::vector<MappingRecord>&) {
      wanted = pipeline.dense()->views().in_part(map, PartId{0}, nullptr);
    });
    return wanted;
  };
  std::size_t changes = 0;
  const auto follow = [&] {
    const std::map<KeyframeId, ViewSituation> wanted = situations();
    while (const std::size_t done = live.follow(wanted, 0.0, 1)) changes += done;
  };
  for (const RgbdFrame& frame : frames) {
    if (!pipeline.process(frame).keyframe) continue;
    live.add(situations().rbegin()->first, frame.timestamp, frame.color, frame.depth, {});
    follow();
    (void)live.cloud();  // which lets the volume catch up with what it had not seen
  }
  pipeline.finish();
  follow();
  ASSERT_EQ(live.rebuilds(), 0U);
  ASSERT_GT(changes, live.size()) << "or else no pose changed";
  // Not EXPECT_EQ: megabytes would be printed.
  EXPECT_TRUE(cloud_ply(live.cloud().cloud) == cloud_ply(pipeline.fuse().cloud));
}

TEST(Cloud, IsNotMadeWhereNobodyWantsIt) {
  Config config = without_segmenter();
  config.dense.enabled = false;
  const Pipeline pipeline(testing::small_camera(), config);
  EXPECT_EQ(pipeline.dense(), nullptr);
}

}  // namespace
}  // namespace ipl_slam
