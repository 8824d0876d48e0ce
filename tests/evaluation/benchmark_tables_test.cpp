#include "evaluation/benchmark_tables.hpp"

#include <cmath>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

using ::testing::HasSubstr;

BenchmarkRecord run(const std::string& sequence, const std::string& configuration, int number, double rmse,
                    std::size_t tracked = 100) {
  BenchmarkRecord record;
  record.key = {"1", sequence, configuration, number, "", ""};
  record.frames = 100;
  record.tracked = tracked;
  record.lost = 100 - tracked;
  record.errors = BenchmarkErrors{};
  record.errors->ate_rmse = rmse;
  record.errors->ate_mean = 0.9 * rmse;
  record.errors->ate_median = 0.8 * rmse;
  record.errors->ate_std = 0.4 * rmse;
  record.errors->frame_translation = 0.5 * rmse;
  record.stages = {{"features", {100, 8.0}}, {"lines", {10, 20.0}}, {"frame", {100, 15.0}}};
  return record;
}

BenchmarkRecord failed_run(const std::string& sequence, const std::string& configuration, int number) {
  BenchmarkRecord record;
  record.key = {"1", sequence, configuration, number, "", ""};
  record.failure = "no map";
  return record;
}

BenchmarkResults results() {
  BenchmarkResults r;
  r.sequences = {{"fr3_walking_xyz", find_published("fr3_walking_xyz"), ""}, {"room", nullptr, ""}};
  r.configurations = {"default", "paper"};
  return r;
}

const TableRow& row_of(const Table& table, const std::string& sequence, const std::string& system) {
  for (const TableRow& row : table.rows) {
    if (row.sequence == sequence && row.system == system) return row;
  }
  throw std::runtime_error("no row " + sequence + ' ' + system);
}

TEST(BenchmarkTables, MeanAndSpreadStandBesideThePublishedFigures) {
  BenchmarkResults r = results();
  r.records = {run("fr3_walking_xyz", "default", 0, 0.010), run("fr3_walking_xyz", "default", 1, 0.014),
               run("fr3_walking_xyz", "paper", 0, 0.013)};
  const Table table = ate_table(r);
  EXPECT_EQ(row_of(table, "fr3_walking_xyz", "DS-SLAM (published)").cells[0].value, 0.0288);
  EXPECT_EQ(row_of(table, "fr3_walking_xyz", "IPL-SLAM (published)").cells[3].value, 0.0068);
  const TableCell& ours = row_of(table, "fr3_walking_xyz", "default").cells[0];
  EXPECT_DOUBLE_EQ(*ours.value, 0.012);
  EXPECT_DOUBLE_EQ(*ours.std, 0.004 / std::sqrt(2.0));
  EXPECT_TRUE(ours.bold) << "0.012 beats 0.0129";
  const TableCell& paper = row_of(table, "fr3_walking_xyz", "paper").cells[0];
  EXPECT_FALSE(paper.bold) << "0.013 does not";
  EXPECT_FALSE(paper.std) << "one run has no spread";
}

TEST(BenchmarkTables, AnErrorOfHalfASequenceBeatsNobody) {
  BenchmarkResults r = results();
  r.records = {run("fr3_walking_xyz", "default", 0, 0.005), run("fr3_walking_xyz", "default", 1, 0.005, 50)};
  const TableCell cell = row_of(ate_table(r), "fr3_walking_xyz", "default").cells[0];
  EXPECT_FALSE(cell.bold);
  EXPECT_EQ(cell.text, "†");
  EXPECT_FALSE(systems_table(r).rows.front().cells[published_systems().size()].bold);
}

TEST(BenchmarkTables, OfSystemsHasThePapersSequencesOnly) {
  BenchmarkResults r = results();
  r.records = {run("fr3_walking_xyz", "default", 0, 0.02), run("room", "default", 0, 0.01)};
  Table table = systems_table(r);
  ASSERT_EQ(table.rows.size(), 1u);
  EXPECT_EQ(table.rows[0].cells[0].value, 0.5359);
  EXPECT_EQ(table.columns[published_systems().size()].title, "ours: default");
  EXPECT_EQ(table.rows[0].cells[published_systems().size()].value, 0.02);
  r.sequences.erase(r.sequences.begin());
  table = systems_table(r);
  EXPECT_TRUE(table.rows.empty());
  EXPECT_THAT(table.note, HasSubstr("None of the sequences"));
}

TEST(BenchmarkTables, LeaveUnknownWhatTheSourceLost) {
  BenchmarkResults r = results();
  r.sequences = {{"fr3_sitting_rpy", find_published("fr3_sitting_rpy"), ""}};
  const TableRow row = systems_table(r).rows.front();
  EXPECT_FALSE(row.cells[0].value) << "ORB-SLAM2";
  EXPECT_EQ(row.cells[1].value, 0.0213) << "DS-SLAM";
  EXPECT_EQ(row.cells[7].value, 0.0198) << "IPL-SLAM";
}

TEST(BenchmarkTables, FailuresAreRows) {
  BenchmarkResults r = results();
  r.sequences.push_back({"broken", nullptr, "rgb.txt lists no image"});
  r.records = {run("room", "default", 0, 0.01), failed_run("room", "default", 1),
               failed_run("room", "paper", 0)};
  const Table ate = ate_table(r);
  EXPECT_EQ(row_of(ate, "room", "default").cells[0].value, 0.01) << "the run that ended well counts";
  EXPECT_EQ(row_of(ate, "room", "paper").cells[0].text, "failed");
  EXPECT_EQ(row_of(ate, "broken", "").cells[0].text, "not run");
  const Table runs = runs_table(r);
  EXPECT_EQ(row_of(runs, "room", "default").cells[0].text, "1 of 2");
  EXPECT_EQ(row_of(runs, "room", "default").cells.back().text, "no map");
  EXPECT_EQ(row_of(runs, "broken", "").cells.back().text, "rgb.txt lists no image");
}

TEST(BenchmarkTables, WithoutGroundTruthHaveTimesOnly) {
  BenchmarkResults r = results();
  r.records = {run("room", "default", 0, 0.01)};
  r.records[0].errors.reset();
  EXPECT_EQ(row_of(ate_table(r), "room", "default").cells[0].text, "no usable ground truth");
  EXPECT_EQ(row_of(times_table(r), "room", "default").cells[0].value, 8.0);
}

TEST(BenchmarkTables, OfAblationHaveTheConfigurationsAsColumns) {
  BenchmarkResults r = results();
  r.ablation = {{"default", {"a", "b", "c", "default"}}};
  r.records = {run("fr3_walking_xyz", "a", 0, 0.4), run("fr3_walking_xyz", "b", 0, 0.3),
               run("fr3_walking_xyz", "default", 0, 0.1)};
  const Table table = ablation_table(r);
  EXPECT_EQ(row_of(table, "fr3_walking_xyz", "IPL-SLAM (published)").cells[1].value, 0.012945);
  const TableRow& row = row_of(table, "fr3_walking_xyz", "default");
  EXPECT_EQ(row.cells[0].value, 0.4);
  EXPECT_EQ(row.cells[1].value, 0.3);
  EXPECT_FALSE(row.cells[2].value);
  EXPECT_EQ(row.cells[3].value, 0.1);
}

TEST(BenchmarkTables, SpreadTheTimeOfLinesOverAllFrames) {
  BenchmarkResults r = results();
  r.records = {run("fr3_walking_xyz", "default", 0, 0.01)};
  const Table table = times_table(r);
  EXPECT_EQ(row_of(table, "fr3_walking_xyz", "IPL-SLAM (published)").cells[3].value, 125.18);
  const TableRow& ours = row_of(table, "fr3_walking_xyz", "default");
  EXPECT_EQ(ours.cells[1].value, 20.0);
  EXPECT_DOUBLE_EQ(*ours.cells[2].value, 8.0 + 10 * 20.0 / 100);
  EXPECT_EQ(ours.cells[5].value, 15.0);
}

// Differences -1, -2, -3 mm: t = -2 / (1 / sqrt 3), W+ = 0, exact p = 2 / 8.
TEST(BenchmarkTables, CompareTheSameRunsOfTwoConfigurations) {
  BenchmarkResults r = results();
  r.compared.emplace("default", "paper");
  r.records = {run("room", "default", 0, 0.010), run("room", "paper", 0, 0.011),
               run("room", "default", 1, 0.010), run("room", "paper", 1, 0.012),
               run("room", "default", 2, 0.010), run("room", "paper", 2, 0.013),
               run("room", "default", 3, 0.010), failed_run("room", "paper", 3)};
  const Table table = comparison_table(r);
  const TableRow& all = row_of(table, "all pairs", "");
  EXPECT_EQ(all.cells[0].value, 3.0);
  EXPECT_DOUBLE_EQ(*all.cells[1].value, 0.010);
  EXPECT_DOUBLE_EQ(*all.cells[2].value, 0.012);
  EXPECT_NEAR(*all.cells[3].value, -0.002, 1e-15);
  EXPECT_NEAR(*all.cells[4].value, -2.0 * std::sqrt(3.0), 1e-9);
  EXPECT_EQ(all.cells[6].value, 0.0);
  EXPECT_EQ(all.cells[7].value, 0.25);
  const TableRow& means = row_of(table, "means of the sequences", "");
  EXPECT_EQ(means.cells[0].value, 1.0);
  EXPECT_FALSE(means.cells[5].value) << "one pair has no spread: no t test";
}

TEST(BenchmarkTables, SaySoWhereThereIsNoPair) {
  BenchmarkResults r = results();
  r.compared.emplace("default", "paper");
  EXPECT_THAT(comparison_table(r).note, HasSubstr("no pair"));
  EXPECT_TRUE(comparison_table(r).rows.empty());
}

TEST(BenchmarkTables, AreThoseForWhichThereIsSomething) {
  BenchmarkResults r = results();
  const auto ids = [&] {
    std::string list;
    for (const Table& table : benchmark_tables(r)) list += table.id + ' ';
    return list;
  };
  EXPECT_EQ(ids(), "1 2 4 rpe runs ");
  r.ablation = {{"default", {"a", "b", "c", "default"}}};
  r.compared.emplace("default", "paper");
  EXPECT_EQ(ids(), "1 2 3 4 rpe comparison runs ");
}

}  // namespace
}  // namespace ipl_slam
