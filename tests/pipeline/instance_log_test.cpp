#include "pipeline/instance_log.hpp"

#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace ipl_slam {
namespace {

InstanceRecord person(std::uint32_t id, MotionState state, std::optional<double> similarity) {
  return {InstanceId{id},
          "person",
          0.75F,
          {10, 20, 30, 40},
          900,
          0,
          ContourVerdict{InstanceId{id}, state, similarity}};
}

FrameRecord frame(std::size_t index, int mask_age, std::vector<InstanceRecord> instances) {
  FrameRecord record;
  record.index = index;
  record.timestamp = 0.5 * static_cast<double>(index);
  record.result.mask_age = mask_age;
  record.result.instances = std::move(instances);
  return record;
}

std::vector<nlohmann::json> parsed(const std::string& lines) {
  std::vector<nlohmann::json> all;
  std::istringstream stream(lines);
  for (std::string line; std::getline(stream, line);) all.push_back(nlohmann::json::parse(line));
  return all;
}

TEST(InstanceLog, TellsOfEveryFrameWhoIsInItAndWhatWasDecided) {
  SequenceRun run;
  run.frames = {frame(3, 2, {person(7, MotionState::kStill, 0.91)}), frame(4, -1, {})};
  const std::vector<nlohmann::json> lines = parsed(instances_jsonl(run, {}));
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[0]["frame"], 3);
  EXPECT_EQ(lines[0]["timestamp"], 1.5);
  EXPECT_EQ(lines[0]["mask_age"], 2);
  const nlohmann::json& instance = lines[0]["instances"][0];
  EXPECT_EQ(instance["id"], 7);
  EXPECT_EQ(instance["class"], "person");
  EXPECT_EQ(instance["score"], 0.75);
  EXPECT_EQ(instance["box"], nlohmann::json({10, 20, 30, 40}));
  EXPECT_EQ(instance["area"], 900);
  EXPECT_EQ(instance["similarity"], 0.91);
  EXPECT_EQ(instance["state"], "still");
  EXPECT_EQ(instance["dynamic"], false);
  EXPECT_TRUE(lines[1]["mask_age"].is_null()) << "no masks yet";
  EXPECT_TRUE(lines[1]["instances"].empty());
}

TEST(InstanceLog, MarksMasksThatWereFoundDynamicLater) {
  SequenceRun run;
  for (std::size_t i = 0; i < 4; ++i)
    run.frames.push_back(frame(i, 0, {person(1, MotionState::kCandidate, {})}));
  run.frames.push_back(frame(4, 0, {person(1, MotionState::kMoving, 0.4)}));
  DynamicSpans dynamic;
  dynamic.add({InstanceId{1}, 2, 4});
  const std::vector<nlohmann::json> lines = parsed(instances_jsonl(run, dynamic));
  const std::vector<bool> expected{false, false, true, true, true};
  for (std::size_t i = 0; i < lines.size(); ++i) {
    EXPECT_EQ(lines[i]["instances"][0]["dynamic"], expected[i]) << "frame " << i;
  }
  EXPECT_TRUE(lines[0]["instances"][0]["similarity"].is_null());
}

TEST(InstanceLog, TellsWhatWasRemovedAndWhy) {
  InstanceRecord mover = person(1, MotionState::kCandidate, {});
  mover.region = RegionVerdict{.dynamic = true,
                               .evidence = {.points = 9, .moved_points = 7, .lines = 2, .moved_lines = 1},
                               .belief = 3.25};
  mover.removed = {.points = 12, .lines = 3};
  InstanceRecord still = person(2, MotionState::kStill, 0.9);
  still.region = RegionVerdict{};
  const nlohmann::json line = nlohmann::json::parse(instances_line(0, 0.0, 0, {mover, still}));
  const nlohmann::json& first = line["instances"][0];
  EXPECT_EQ(first["removed"], true);
  EXPECT_EQ(first["belief"], 3.25);
  EXPECT_EQ(first["moved_points"], nlohmann::json({7, 9}));
  EXPECT_EQ(first["moved_lines"], nlohmann::json({1, 2}));
  EXPECT_EQ(first["landmarks_removed"], nlohmann::json({{"points", 12}, {"lines", 3}}));
  EXPECT_EQ(line["instances"][1]["removed"], false);
  EXPECT_FALSE(line["instances"][1].contains("landmarks_removed"));
}

TEST(InstanceLog, SaysNothingOfMotionWhereNobodyJudged) {
  InstanceRecord record = person(0, MotionState::kStill, {});
  record.verdict.reset();
  const nlohmann::json line = nlohmann::json::parse(instances_line(0, 0.0, 0, {record}));
  EXPECT_FALSE(line["instances"][0].contains("state"));
  EXPECT_FALSE(line["instances"][0].contains("dynamic"));
}

}  // namespace
}  // namespace ipl_slam
