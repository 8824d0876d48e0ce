#include "pipeline/run_report.hpp"

#include <algorithm>
#include <sstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pipeline/sequence_run.hpp"
#include "support/rendered_sequence.hpp"

namespace ipl_slam {
namespace {

using ::testing::HasSubstr;
using testing::KeptFrames;
using testing::render_all;
using testing::small_camera;
using testing::small_room;
using ::testing::StartsWith;

/// Frames, and in between them two that cannot be read.
class PartlyBroken : public RgbdSource {
 public:
  explicit PartlyBroken(std::vector<RgbdFrame> frames) : frames_(std::move(frames)) {}
  [[nodiscard]] std::optional<SourceItem> next() override {
    std::optional<SourceItem> item = frames_.next();
    if (!item || ++position_ % 4 != 0) return item;
    return SourceItem{std::nullopt, item->timestamp, "truncated color image", "rgb/x.png: too short"};
  }
  [[nodiscard]] std::size_t size() const override { return frames_.size(); }

 private:
  KeptFrames frames_;
  int position_ = 0;
};

/// Ten frames, two of them broken, run once for all tests below.
struct TenFrames {
  Pipeline pipeline{small_camera(), {}};
  SequenceRun result;
  TenFrames() {
    PartlyBroken source(render_all(small_room(10)));
    result = run_sequence(source, pipeline);
  }
  [[nodiscard]] nlohmann::ordered_json summary() const {
    return run_summary(result, {"room", "default", small_camera(), {}, 3}, pipeline, nullptr);
  }
};

TEST(RunSummary, CountsEveryFrameExactlyOnce) {
  const nlohmann::ordered_json frames = TenFrames().summary()["frames"];
  EXPECT_EQ(frames["total"], 10);
  EXPECT_EQ(frames["processed"], 8);
  EXPECT_EQ(frames["tracked"], 8);
  EXPECT_EQ(frames["lost"], 0);
  EXPECT_EQ(frames["initializing"], 0);
  EXPECT_EQ(frames["skipped"]["count"], 2);
  EXPECT_EQ(frames["skipped"]["reasons"]["truncated color image"], 2);
  EXPECT_EQ(frames["skipped"]["frames"][0]["detail"], "rgb/x.png: too short");
  EXPECT_EQ(frames["unpaired_color"], 3);
}

TEST(RunSummary, HoldsVersionSettingCameraMapAndTimes) {
  const TenFrames run;
  const nlohmann::ordered_json json = run.summary();
  EXPECT_FALSE(json["version"].get<std::string>().empty());
  EXPECT_EQ(json["sequence"], "room");
  EXPECT_EQ(json["preset"], "default");
  EXPECT_EQ(json["interrupted"], false);
  EXPECT_TRUE(json["evaluation"].is_null());
  EXPECT_EQ(json["camera"]["width"], 320);
  EXPECT_EQ(json["config"]["orb"]["features"], Config().orb.features);
  EXPECT_GT(json["map"]["landmarks"], 100);
  EXPECT_GT(json["peak_memory_bytes"], 1 << 20);
  EXPECT_GT(json["frames_per_second"], 0.0);
  for (const char* stage : {"load", "features", "instances", "segmentation", "tracks", "contours", "dynamics",
                            "tracking", "frame"}) {
    const auto& times = json["timing_ms"][stage];
    EXPECT_EQ(times["count"], 8) << stage;
    EXPECT_LE(times["p50"], times["p90"]) << stage;
    EXPECT_LE(times["p90"], times["p99"]) << stage;
    EXPECT_LE(times["p99"], times["max"]) << stage;
  }
  EXPECT_GT(json["map"]["lines"], 10);
  for (const char* stage : {"lines", "mapping"}) {
    EXPECT_EQ(json["timing_ms"][stage]["count"], json["map"]["keyframes"]) << stage;
  }
}

TEST(TimingsCsv, HasALinePerProcessedFrameWithAsManyFieldsAsItsHeader) {
  const TenFrames run;
  std::istringstream csv(timings_csv(run.result));
  std::string header, line;
  std::getline(csv, header);
  EXPECT_EQ(header,
            "frame,timestamp,state,keypoints,inliers,lines,keyframe,load_ms,features_ms,instances_ms,"
            "dynamics_ms,tracking_ms,lines_ms,mapping_ms");
  std::vector<std::string> lines;
  while (std::getline(csv, line)) lines.push_back(line);
  ASSERT_EQ(lines.size(), 8U);
  EXPECT_THAT(lines[0], StartsWith("0,0.000000,tracking,"));
  EXPECT_THAT(lines[3], StartsWith("4,0.133333,tracking,")) << "frame 3 is one of the broken ones";
  for (const std::string& each : lines) {
    EXPECT_EQ(std::count(each.begin(), each.end(), ','), std::count(header.begin(), header.end(), ','));
  }
}

TEST(RunText, NamesWhatWasSkippedWithAnExample) {
  const TenFrames run;
  const std::string text = run_text(run.result, run.pipeline);
  run.pipeline.mapping().read([&](const Map& map, const std::vector<MappingRecord>&) {
    EXPECT_THAT(text, HasSubstr("10 frames: 8 tracked, 0 lost, 2 skipped"));
    EXPECT_THAT(text, HasSubstr(fmt::format("{} points, {} lines", map.points().size(), map.lines().size())));
    EXPECT_THAT(text, HasSubstr("2 x truncated color image, e.g. rgb/x.png: too short"));
  });
}

TEST(RunSequence, StopsWhenAskedAndKeepsWhatWasTracked) {
  KeptFrames source(render_all(small_room(10)));
  Pipeline pipeline(small_camera(), {});
  std::size_t seen = 0;
  RunHooks hooks;
  hooks.stop = [&] { return seen == 4; };
  hooks.item_taken = [&](const SequenceRun&) { ++seen; };
  const SequenceRun run = run_sequence(source, pipeline, hooks);
  EXPECT_TRUE(run.interrupted);
  EXPECT_EQ(run.frames.size(), 4U);
  EXPECT_EQ(pipeline.trajectory().size(), 4U);
}

TEST(RunSequence, EndsAtTheLimitWithoutCallingItAnInterruption) {
  KeptFrames source(render_all(small_room(10)));
  Pipeline pipeline(small_camera(), {});
  const SequenceRun run = run_sequence(source, pipeline, {}, 6);
  EXPECT_FALSE(run.interrupted);
  EXPECT_EQ(run.frames.size(), 6U);
}

}  // namespace
}  // namespace ipl_slam
