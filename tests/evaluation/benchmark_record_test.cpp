#include "evaluation/benchmark_record.hpp"

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

using Json = nlohmann::ordered_json;

const BenchmarkKey kKey = {"1.2", "tum/room", "paper", 3, "abc", "def"};

Json errors(double rmse) {
  return {{"rmse", rmse}};
}

// As run_summary writes it, cut to what is read.
Json summary() {
  return {{"version", "1.2"},
          {"sequence", "/data/room"},
          {"frames",
           {{"total", 10}, {"tracked", 7}, {"lost", 1}, {"initializing", 0}, {"skipped", {{"count", 2}}}}},
          {"evaluation",
           {{"ate", {{"rmse", 0.05}, {"mean", 0.04}, {"median", 0.03}, {"std", 0.02}, {"coverage", 0.9}}},
            {"rpe_frame", {{"translation", errors(0.001)}, {"rotation_deg", errors(0.2)}}},
            {"rpe_second", nullptr}}},
          {"timing_ms", {{"features", {{"count", 8}, {"mean", 6.5}}}, {"lines", nullptr}}}};
}

TEST(BenchmarkRecord, OfARunComesBackFromItsText) {
  const auto record = parse_record(record_of_run(kKey, summary()).dump());
  ASSERT_TRUE(record);
  EXPECT_EQ(record->key, kKey);
  EXPECT_TRUE(record->ok());
  EXPECT_EQ(record->frames, 10u);
  EXPECT_EQ(record->tracked, 7u);
  EXPECT_EQ(record->lost, 1u);
  EXPECT_EQ(record->skipped, 2u);
  ASSERT_TRUE(record->errors);
  EXPECT_EQ(record->errors->ate_rmse, 0.05);
  EXPECT_EQ(record->errors->ate_std, 0.02);
  EXPECT_EQ(record->errors->coverage, 0.9);
  EXPECT_EQ(record->errors->frame_rotation, 0.2);
  EXPECT_FALSE(record->errors->second_translation);
  EXPECT_EQ(record->stages.at("features").mean, 6.5);
  EXPECT_EQ(record->stages.count("lines"), 0u);
}

TEST(BenchmarkRecord, WithoutGroundTruthHasNoErrors) {
  Json json = summary();
  json["evaluation"] = nullptr;
  const auto record = parse_record(record_of_run(kKey, json).dump());
  ASSERT_TRUE(record);
  EXPECT_FALSE(record->errors);
}

TEST(BenchmarkRecord, OfAFailureSaysWhy) {
  const auto record = parse_record(record_of_failure(kKey, "no map").dump());
  ASSERT_TRUE(record);
  EXPECT_EQ(record->key, kKey);
  EXPECT_FALSE(record->ok());
  EXPECT_EQ(record->failure, "no map");
}

TEST(BenchmarkRecord, OfSomethingElseIsNone) {
  EXPECT_FALSE(parse_record(""));
  EXPECT_FALSE(parse_record("{}"));
  EXPECT_FALSE(parse_record("[1, 2"));
  Json json = record_of_run(kKey, summary());
  json["frames"].erase("tracked");
  EXPECT_FALSE(parse_record(json.dump()));
  json = record_of_run(kKey, summary());
  json["run"] = "three";
  EXPECT_FALSE(parse_record(json.dump()));
}

}  // namespace
}  // namespace ipl_slam
