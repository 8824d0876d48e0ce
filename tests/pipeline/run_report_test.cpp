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

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::KeptFrames;
using ::testing::Not;
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

TEST(RunSummary, TellsWhatTheCloudHolds) {
  TenFrames run;
  EXPECT_TRUE(run.summary()["cloud"].is_null()) << "nothing was fused";
  EXPECT_THAT(run_text(run.result, run.pipeline), Not(HasSubstr("cloud")));

  const FusedRun fused{run.pipeline.fuse(), 1.25};
  const nlohmann::ordered_json summary =
      run_summary(run.result, {"room", "default", small_camera(), {}, 3}, run.pipeline, nullptr, &fused);
  const nlohmann::ordered_json& cloud = summary["cloud"];
  ASSERT_GT(fused.result.cloud.points.size(), 1000U);
  EXPECT_EQ(cloud["points"], fused.result.cloud.points.size());
  EXPECT_EQ(cloud["labelled"], 0) << "nobody told of classes";
  EXPECT_EQ(cloud["objects"], 0);
  EXPECT_EQ(cloud["keyframes"], summary["map"]["keyframes"]);
  EXPECT_EQ(cloud["keyframes_of_other_parts"], 0);
  EXPECT_EQ(cloud["keyframes_dropped"], 0);
  EXPECT_EQ(cloud["rebuilds"], 0);
  EXPECT_EQ(cloud["refused_blocks"], 0);
  EXPECT_GT(cloud["volume_bytes"], 1 << 20);
  EXPECT_GT(cloud["view_bytes"], 10000);
  EXPECT_EQ(cloud["seconds"], 1.25);
  EXPECT_THAT(run_text(run.result, run.pipeline, &fused),
              AllOf(HasSubstr(fmt::format("cloud of {} points, 0 of them with a class, 0 objects; volume ",
                                          fused.result.cloud.points.size())),
                    HasSubstr(", 1.2 s\n"), Not(HasSubstr("cut short")), Not(HasSubstr("other parts"))));
}

TEST(RunSummary, CountsTheLabelledPointsOfTheCloud) {
  TenFrames run;
  FusedRun fused{run.pipeline.fuse(), 0.0};
  for (std::size_t i = 0; i < 7; ++i) fused.result.cloud.points.at(i).label = 56;
  fused.result.objects.resize(2);
  const nlohmann::ordered_json cloud = run_summary(run.result, {}, run.pipeline, nullptr, &fused)["cloud"];
  EXPECT_EQ(cloud["labelled"], 7);
  EXPECT_EQ(cloud["objects"], 2);
}

TEST(RunSummary, SaysWhereTheCloudIsCutShort) {
  Config config;
  config.dense.volume.max_memory = 1;  // MiB, less than a user may set: the room takes 8
  Pipeline pipeline(small_camera(), config);
  KeptFrames source(render_all(small_room(10)));
  const SequenceRun result = run_sequence(source, pipeline);
  const FusedRun fused{pipeline.fuse(), 0.0};
  EXPECT_GT(run_summary(result, {}, pipeline, nullptr, &fused)["cloud"]["refused_blocks"], 0);
  EXPECT_THAT(run_text(result, pipeline, &fused), HasSubstr("cut short at dense.volume.max_memory"));
}

// The camera goes dark for longer than it takes to give up, and comes back to another room: the map is in two
// parts, the second one of more frames.
struct TwoRooms {
  Pipeline pipeline{small_camera(), {}};
  SequenceRun result;
  TwoRooms() {
    std::vector<RgbdFrame> frames = render_all(small_room(6));
    for (RgbdFrame& frame : render_all(small_room(10))) {
      RgbdFrame mirrored = frame;
      cv::flip(frame.color, mirrored.color, 1);
      cv::flip(frame.depth, mirrored.depth, 1);
      frames.push_back(std::move(mirrored));
    }
    for (std::size_t i = 0; i < frames.size(); ++i) {
      frames[i].index = i;
      frames[i].timestamp = static_cast<double>(i) / 30.0 + (i < 7 ? 0.0 : 5.0);
    }
    frames[6].color = cv::Mat(frames[6].color.size(), frames[6].color.type(), cv::Scalar::all(0));
    KeptFrames source(std::move(frames));
    result = run_sequence(source, pipeline);
  }
};

TEST(RunSummary, ListsThePartsOfTheMapTheLargestFirst) {
  TwoRooms run;
  const std::size_t lost = run.result.count(TrackingState::kLost);
  ASSERT_EQ(run.result.count(TrackingState::kTracking) + lost, 16U);
  ASSERT_LE(lost, 2U) << "the dark frame, and none of the other room is known";
  RunSetting setting{"rooms", "default", small_camera(), {}, 0};
  const auto map_of = [&] { return run_summary(run.result, setting, run.pipeline, nullptr)["map"]; };
  const nlohmann::ordered_json map = map_of();
  EXPECT_TRUE(map["loaded"].is_null());
  EXPECT_EQ(map["localize_only"], false);
  ASSERT_EQ(map["parts"].size(), 2U);
  EXPECT_EQ(map["parts"][0]["part"], 1);
  EXPECT_EQ(map["parts"][0]["tracked"], 10 - lost);
  EXPECT_EQ(map["parts"][0]["loaded"], false);
  EXPECT_EQ(map["parts"][1]["part"], 0);
  EXPECT_EQ(map["parts"][1]["tracked"], 6);
  EXPECT_EQ(run.pipeline.trajectory().size(), map["parts"][0]["tracked"].get<std::size_t>());
  EXPECT_EQ(run.pipeline.keyframe_parts().front().part, PartId{1});
  EXPECT_THAT(run_text(run.result, run.pipeline),
              HasSubstr("  6 frames are in part 0 of the map, which was not joined to the rest\n"));

  const FusedRun fused{run.pipeline.fuse(), 0.0};
  const nlohmann::ordered_json cloud =
      run_summary(run.result, setting, run.pipeline, nullptr, &fused)["cloud"];
  EXPECT_GT(cloud["keyframes"], 0);
  EXPECT_GT(cloud["keyframes_of_other_parts"], 0);
  EXPECT_EQ(cloud["keyframes"].get<std::size_t>() + cloud["keyframes_of_other_parts"].get<std::size_t>(),
            run_summary(run.result, setting, run.pipeline, nullptr)["map"]["keyframes"]);
  EXPECT_THAT(run_text(run.result, run.pipeline, &fused), HasSubstr("keyframes of other parts of the map"));

  setting.loaded_map = "old.map";
  setting.loaded_parts = 1;
  EXPECT_EQ(map_of()["loaded"], "old.map");
  EXPECT_EQ(map_of()["parts"][0]["loaded"], false);
  EXPECT_EQ(map_of()["parts"][1]["loaded"], true);
}

TEST(RunSummary, ListsThePlacesThatWereRecognised) {
  const std::vector<RgbdFrame> frames = render_all(small_room(8));
  Pipeline first(small_camera(), {});
  for (const RgbdFrame& frame : frames) (void)first.process(frame);
  std::optional<Map> map;
  first.mapping().read([&](const Map& made, const std::vector<MappingRecord>&) { map = made; });
  EXPECT_TRUE(run_summary({}, {}, first, nullptr)["places"].empty());

  // Of a map that is taken up again the first thing is to find the camera in it. It may well stand where the
  // local map around the newest keyframe can tell; then no place is asked for.
  Pipeline again(small_camera(), {}, map, true);
  KeptFrames source(frames);
  const SequenceRun run = run_sequence(source, again);
  EXPECT_EQ(run.count(TrackingState::kTracking), frames.size());
  const std::vector<PlaceEvent> events = again.mapping().events();
  const nlohmann::ordered_json places = run_summary(run, {}, again, nullptr)["places"];
  ASSERT_EQ(places.size(), events.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_EQ(places[i]["what"], "relocalized");
    EXPECT_EQ(places[i]["frame"], events[i].frame_index);
    EXPECT_EQ(places[i]["known_frame"], events[i].known_index);
    EXPECT_EQ(places[i]["inliers"], events[i].inliers);
    EXPECT_FALSE(places[i].contains("correction_m")) << "of loops alone";
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
