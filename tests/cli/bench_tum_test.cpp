#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "dataset/synthetic/write_sequence.hpp"
#include "program.hpp"
#include "refused.hpp"
#include "support/rendered_sequence.hpp"

namespace ipl_slam {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using testing::content_of;
using testing::expect_refused;
using testing::Finished;
using ::testing::HasSubstr;
using testing::ipl_slam_program;
using ::testing::Not;
using testing::run_program;
using testing::small_room;
using testing::TemporaryFolder;

/// Two rendered sequences, one of them deeper down, and one whose images are all missing.
class Datasets {
 public:
  Datasets() {
    SequenceWriteOptions options;
    options.threads = 2;
    write_sequence(SyntheticSource(small_room(6)), path() / "room", options);
    write_sequence(SyntheticSource(small_room(5, "xyz")), path() / "more/walk", options);
    fs::create_directories(path() / "broken");
    fs::copy(path() / "room", path() / "broken", fs::copy_options::recursive);
    fs::remove_all(path() / "broken/rgb");
  }
  [[nodiscard]] fs::path path() const { return folder_ / "datasets"; }
  [[nodiscard]] fs::path output() const { return folder_ / "out"; }
  [[nodiscard]] fs::path record(const std::string& run) const { return output() / "runs" / (run + ".json"); }
  void write(const std::string& name, const std::string& content) const {
    folder_.write("datasets/" + name, content);
  }

  /// `runs` in lockstep of the preset "default".
  [[nodiscard]] std::vector<std::string> command(const char* runs,
                                                 const std::vector<std::string>& more) const {
    std::vector<std::string> words = {"bench",     "tum",     path().string(), "-o", output().string(),
                                      "--presets", "default", "--runs",        runs};
    if (std::find(more.begin(), more.end(), "--segmenter") == more.end()) {
      words.insert(words.end(), {"--segmenter", "none"});
    }
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  [[nodiscard]] Finished run(const char* runs, const std::vector<std::string>& more = {}) const {
    return ipl_slam_program(command(runs, more));
  }

 private:
  TemporaryFolder folder_;
};

nlohmann::json json_of(const fs::path& file) {
  return nlohmann::json::parse(content_of(file));
}

TEST(CliBenchTum, RunsEverySequenceAndGoesOnWhereItStopped) {
  const Datasets datasets;
  const Finished first = datasets.run("2");
  EXPECT_EQ(first.code, 0) << first.err;
  EXPECT_THAT(first.out, AllOf(HasSubstr("more/walk: 5 frames"), HasSubstr("room, default, run 1: ATE"),
                               HasSubstr("6 of 6 frames tracked"), HasSubstr("2 of 6 runs failed")));
  EXPECT_THAT(first.err,
              AllOf(HasSubstr("broken, default, run 0: failed"), HasSubstr("missing color image")));

  const nlohmann::json record = json_of(datasets.record("room/default/0"));
  EXPECT_EQ(record["status"], "done");
  EXPECT_EQ(record["frames"]["tracked"], 6);
  EXPECT_LT(record["evaluation"]["ate"]["rmse"], 0.02);
  EXPECT_EQ(record["config"]["features"]["noise"], 0.0);
  const nlohmann::json disturbed = json_of(datasets.record("more/walk/default/1"));
  EXPECT_EQ(disturbed["config"]["features"]["noise"], 1.0);
  EXPECT_EQ(disturbed["config"]["schedule"]["seed"], 1);
  EXPECT_EQ(json_of(datasets.record("broken/default/1"))["status"], "failed");

  const std::string markdown = content_of(datasets.output() / "tables.md");
  EXPECT_THAT(markdown, AllOf(HasSubstr("## Table 1"), HasSubstr("| room | default |"), HasSubstr(" ± "),
                              HasSubstr("| broken | default | failed |"), HasSubstr("missing color image")));
  EXPECT_THAT(content_of(datasets.output() / "tables.csv"), HasSubstr("\n1,more/walk,default,RMSE,m,0.0"));
  EXPECT_EQ(json_of(datasets.output() / "tables.json")["tables"][0]["id"], "1");

  // The broken sequence is mended: only its runs are left to do.
  fs::copy(datasets.path() / "room/rgb", datasets.path() / "broken/rgb", fs::copy_options::recursive);
  const Finished second = datasets.run("2");
  EXPECT_EQ(second.code, 0) << second.err;
  EXPECT_THAT(second.out,
              AllOf(HasSubstr("4 of 6 runs are there already"), HasSubstr("failed before and tried again: 2"),
                    Not(HasSubstr("room, default")), HasSubstr("broken, default, run 1: ATE")));
  const auto written = fs::last_write_time(datasets.record("room/default/0"));
  const Finished third = datasets.run("2");
  EXPECT_EQ(third.code, 0) << third.err;
  EXPECT_THAT(third.out, AllOf(HasSubstr("6 of 6 runs are there already"), HasSubstr("nothing to run"),
                               HasSubstr("| room | default |")));
  EXPECT_EQ(fs::last_write_time(datasets.record("room/default/0")), written);
}

TEST(CliBenchTum, RunsAnewWhatWasMadeFromSomethingElse) {
  const Datasets datasets;
  fs::remove_all(datasets.path() / "broken");
  fs::remove_all(datasets.path() / "more");
  const std::vector<std::string> three_frames = {"--max-frames", "3"};
  EXPECT_EQ(datasets.run("1", three_frames).code, 0);
  const std::vector<std::vector<std::string>> changes = {
      {"--set", "orb.features=900"}, {"--max-frames", "4"}, {"--force"}, {"--segmenter", "geometric"}};
  for (const auto& change : changes) {
    std::vector<std::string> words;
    if (change[0] != "--max-frames") words = three_frames;
    words.insert(words.end(), change.begin(), change.end());
    EXPECT_EQ(datasets.run("1", three_frames).code, 0);
    const std::string said = datasets.run("1", words).out;
    EXPECT_THAT(said, HasSubstr("room, default, run 0: ATE")) << change[0];
    const bool replaces = said.find("replaced one by one: 1") != std::string::npos;
    EXPECT_EQ(replaces, change[0] != "--force") << change[0];
  }
  EXPECT_EQ(datasets.run("1", three_frames).code, 0);
  datasets.write("room/groundtruth.txt", content_of(datasets.path() / "room/groundtruth.txt") + "# mended\n");
  EXPECT_THAT(datasets.run("1", three_frames).out, HasSubstr("room, default, run 0: ATE"));
  // A file that is no record is no result.
  std::ofstream(datasets.record("room/default/0")) << "{";
  EXPECT_THAT(datasets.run("1", three_frames).out, HasSubstr("room, default, run 0: ATE"));
}

TEST(CliBenchTum, ComparesConfigurationsAndRealtime) {
  const Datasets datasets;
  fs::remove_all(datasets.path() / "broken");
  const Finished finished = datasets.run("2", {"--realtime", "--compare", "default-realtime", "default"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_EQ(json_of(datasets.record("room/default-realtime/1"))["config"]["schedule"]["mode"], "realtime");
  EXPECT_THAT(content_of(datasets.output() / "tables.md"),
              AllOf(HasSubstr("default-realtime against default"), HasSubstr("| all pairs | 4 |"),
                    HasSubstr("| room | default |")));
}

TEST(CliBenchTum, SaysWhichSequencesCannotBeRun) {
  const Datasets datasets;
  fs::remove(datasets.path() / "broken/camera.yaml");
  datasets.write("empty/rgb.txt", "# nothing\n");
  datasets.write("empty/depth.txt", "# nothing\n");
  const Finished finished = datasets.run("1", {"--max-frames", "3"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_THAT(finished.err, AllOf(HasSubstr("broken is not run"), HasSubstr("camera.yaml"),
                                  HasSubstr("empty is not run"), HasSubstr("lists no image")));
  EXPECT_THAT(finished.out, HasSubstr("2 of 4 sequences could not be run"));
  EXPECT_THAT(content_of(datasets.output() / "tables.md"), HasSubstr("| broken |  | not run |"));
}

TEST(CliBenchTum, RefusesWhatCannotBeRunAtAll) {
  const TemporaryFolder folder;
  folder.write("empty/readme.txt", "");
  const auto bench = [&](const std::string& datasets, std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"bench", "tum", datasets, "-o", (folder / "out").string(), "-q"});
    return ipl_slam_program(more);
  };
  expect_refused(bench((folder / "nowhere").string()), {"nowhere", "no such folder"});
  expect_refused(bench((folder / "empty").string()), {"empty", "no sequence", "rgb.txt"});
  expect_refused(bench((folder / "empty").string(), {"--compare", "default", "papper"}),
                 {"papper", "'paper'"});
  expect_refused(bench((folder / "empty").string(), {"--compare", "paper", "paper"}), {"--compare", "twice"});
  expect_refused(bench((folder / "empty").string(), {"--presets", "best"}), {"best"});
  expect_refused(bench((folder / "empty").string(), {"--presets", "paper,paper"}), {"--presets", "twice"});
  expect_refused(bench((folder / "empty").string(), {"--set", "orb.featurs=1"}), {"orb.features"});
  expect_refused(bench((folder / "empty").string(), {"--runs", "0"}), {"--realtime-runs"});
  EXPECT_FALSE(fs::exists(folder / "out"));
}

TEST(CliBenchTum, AllRunsFailingIsAnError) {
  const Datasets datasets;
  for (const char* name : {"room", "more"}) fs::remove_all(datasets.path() / name);
  const Finished finished = datasets.run("2");
  EXPECT_EQ(finished.code, 2);
  EXPECT_THAT(finished.err, AllOf(HasSubstr("all 2 runs failed"), HasSubstr("missing color image")));
  EXPECT_THAT(content_of(datasets.output() / "tables.md"), HasSubstr("| broken | default | failed |"));
}

TEST(CliBenchTum, InterruptedKeepsWhatIsDone) {
  const Datasets datasets;
  fs::remove_all(datasets.path() / "broken");
  const auto interrupt = [](pid_t process, const fs::path& out) {
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (content_of(out).find("default, run 0: ATE") == std::string::npos &&
           std::chrono::steady_clock::now() < give_up) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    ::kill(process, SIGINT);
  };
  // Enough runs that the last cannot end before the signal comes.
  std::vector<std::string> words = datasets.command("50", {});
  words.insert(words.begin(), IPL_SLAM_PROGRAM);
  const Finished finished = run_program(words, interrupt);
  EXPECT_EQ(finished.code, 130) << finished.err;
  EXPECT_THAT(finished.err, HasSubstr("goes on where it stopped"));
  EXPECT_TRUE(fs::exists(datasets.output() / "tables.md"));
  EXPECT_FALSE(fs::exists(datasets.record("room/default/49")));
  EXPECT_THAT(datasets.run("1").out, HasSubstr("of 2 runs are there already"));
}

}  // namespace
}  // namespace ipl_slam
