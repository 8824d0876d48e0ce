#include <algorithm>
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "dataset/trajectory.hpp"
#include "made_sequence.hpp"
#include "program.hpp"
#include "refused.hpp"
#include "tiny_disk.hpp"

namespace ipl_slam {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using testing::content_of;
using testing::expect_refused;
using testing::Finished;
using ::testing::HasSubstr;
using testing::interrupt_ipl_slam;
using testing::ipl_slam_program;
using ::testing::IsEmpty;
using testing::MadeSequence;
using ::testing::Not;
using testing::run_program;
using ::testing::StartsWith;
using testing::TemporaryFolder;
using testing::TinyDisk;

Finished run(const MadeSequence& sequence, std::vector<std::string> more = {}) {
  more.insert(more.begin(), {"run", sequence.path().string(), "-o", sequence.output().string()});
  return ipl_slam_program(more);
}

nlohmann::json summary(const fs::path& output) {
  return nlohmann::json::parse(content_of(output / "summary.json"));
}

void expect_nothing_left(const fs::path& output) {
  EXPECT_FALSE(fs::exists(output)) << output;
}

/// All results are there, readable, and nothing else is.
void expect_complete(const fs::path& output, std::size_t poses) {
  for (const char* name :
       {"trajectory.txt", "keyframes.txt", "lines.ply", "timings.csv", "summary.json", "map.png"}) {
    EXPECT_TRUE(fs::exists(output / name)) << name;
  }
  for (const auto& entry : fs::directory_iterator(output)) {
    EXPECT_THAT(entry.path().filename().string(), Not(StartsWith("."))) << "a temporary file was left";
  }
  if (poses > 0) {
    EXPECT_EQ(read_trajectory(output / "trajectory.txt").size(), poses);
  }
  EXPECT_TRUE(summary(output).contains("frames"));
}

TEST(CliRun, TracksARenderedSequenceAndSaysWhatItDid) {
  const MadeSequence sequence;
  const Finished finished = run(sequence);
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_THAT(finished.err, IsEmpty());
  EXPECT_THAT(finished.out, AllOf(HasSubstr("camera.yaml"), HasSubstr("tracking 10/10 frames"),
                                  HasSubstr("10 tracked, 0 lost, 0 skipped"), HasSubstr("ATE [m]")));
  // Not a terminal: no bar is drawn and redrawn.
  EXPECT_THAT(finished.out, AllOf(Not(HasSubstr("\r")), Not(HasSubstr("\x1b"))));
  expect_complete(sequence.output(), 10);
  const nlohmann::json json = summary(sequence.output());
  EXPECT_EQ(json["frames"]["tracked"], 10);
  EXPECT_LT(json["evaluation"]["ate"]["rmse"], 0.02);
  EXPECT_TRUE(fs::exists(sequence.output() / "trajectory.png"));
}

TEST(CliRun, QuietPrintsResultsOnly) {
  const Finished finished = run(MadeSequence(), {"-q"});
  EXPECT_EQ(finished.code, 0);
  EXPECT_THAT(finished.out, AllOf(Not(HasSubstr("tracking")), Not(HasSubstr("camera")), HasSubstr("ATE")));
}

TEST(CliRun, InRealTimeAccountsForEveryFrame) {
  const MadeSequence sequence;
  const Finished finished = run(sequence, {"--realtime"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  const nlohmann::json frames = summary(sequence.output())["frames"];
  EXPECT_EQ(frames["processed"].get<int>() + frames["skipped"]["count"].get<int>(), 10);
}

TEST(CliRun, ASecondRunReplacesTheResultsOfTheFirst) {
  const MadeSequence sequence;
  EXPECT_EQ(run(sequence).code, 0);
  const std::string trajectory = content_of(sequence.output() / "trajectory.txt");
  EXPECT_EQ(run(sequence).code, 0);
  EXPECT_EQ(content_of(sequence.output() / "trajectory.txt"), trajectory);
  // Without ground truth there is no picture of the trajectory; an old one would lie.
  fs::remove(sequence.path() / "groundtruth.txt");
  EXPECT_EQ(run(sequence, {"--max-frames", "4"}).code, 0);
  expect_complete(sequence.output(), 4);
  EXPECT_FALSE(fs::exists(sequence.output() / "trajectory.png"));
}

TEST(CliRun, FindsLinesByTheDetectorThatIsAskedFor) {
  const MadeSequence sequence;
  const auto header = [&] {
    const std::string ply = content_of(sequence.output() / "lines.ply");
    return ply.substr(0, ply.find("end_header"));
  };
  for (const char* method : {"lsd", "edges", "off"}) {
    const Finished finished = run(sequence, {"--set", fmt::format("features.lines={}", method)});
    EXPECT_EQ(finished.code, 0) << finished.err;
    expect_complete(sequence.output(), 10);
    const nlohmann::json json = summary(sequence.output());
    EXPECT_EQ(json["config"]["features"]["lines"], method);
    const int lines = json["map"]["lines"].get<int>();
    EXPECT_EQ(lines > 0, std::string(method) != "off") << method;
    EXPECT_THAT(header(), HasSubstr(fmt::format("element edge {}\n", lines))) << method;
    EXPECT_THAT(finished.out, HasSubstr(fmt::format(" points, {} lines", lines)));
  }
}

TEST(CliRun, MissingFolder) {
  const TemporaryFolder folder;
  const std::string nowhere = (folder / "nowhere").string(), out = (folder / "out").string();
  expect_refused(ipl_slam_program({"run", nowhere, "-o", out}), {nowhere, "no such folder"});
  expect_refused(ipl_slam_program({"run", nowhere, "-o", out, "--camera", "tum1"}), {nowhere});
  expect_nothing_left(out);
}

TEST(CliRun, EmptyMissingOrBrokenLists) {
  const MadeSequence sequence;
  sequence.write("rgb.txt", "# nothing but a comment\n");
  expect_refused(run(sequence), {"rgb.txt", "lists no image"});
  sequence.write("rgb.txt", "0.0 rgb/0.png\nnonsense\n");
  expect_refused(run(sequence), {"rgb.txt:2", "nonsense"});
  for (const char* list : {"rgb.txt", "depth.txt", "associations.txt"}) fs::remove(sequence.path() / list);
  expect_refused(run(sequence), {"rgb.txt", "associations.txt"});
  expect_nothing_left(sequence.output());
}

TEST(CliRun, NoOverlapInTime) {
  const MadeSequence sequence;
  sequence.write("depth.txt", "1000.0 depth/a.png\n1000.1 depth/b.png\n");
  expect_refused(run(sequence), {"rgb.txt", "depth.txt", "same recording"});
  expect_nothing_left(sequence.output());
}

TEST(CliRun, SkipsAndNamesImagesThatCannotBeRead) {
  const MadeSequence sequence;
  fs::resize_file(sequence.image("rgb", 2), 200);
  { std::ofstream(sequence.image("depth", 4), std::ios::binary) << "no picture"; }
  fs::remove(sequence.image("rgb", 6));
  const Finished finished = run(sequence);
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_THAT(finished.out, AllOf(HasSubstr("7 tracked, 0 lost, 3 skipped"),
                                  HasSubstr(sequence.image("rgb", 2).filename().string())));
  const nlohmann::json reasons = summary(sequence.output())["frames"]["skipped"]["reasons"];
  EXPECT_EQ(reasons["truncated color image"], 1);
  EXPECT_EQ(reasons["unreadable depth image"], 1);
  EXPECT_EQ(reasons["missing color image"], 1);
  expect_complete(sequence.output(), 7);
}

TEST(CliRun, SkipsImagesOfWrongDepthOrSize) {
  const MadeSequence sequence;
  sequence.replace("depth", 3, cv::Mat::zeros(240, 320, CV_8UC1));
  sequence.replace("rgb", 5, cv::Mat::zeros(240, 320, CV_16UC3));
  sequence.replace("rgb", 7, cv::Mat::zeros(120, 160, CV_8UC3));
  sequence.replace("depth", 8, cv::Mat::zeros(120, 160, CV_16UC1));
  EXPECT_EQ(run(sequence).code, 0);
  const nlohmann::json reasons = summary(sequence.output())["frames"]["skipped"]["reasons"];
  EXPECT_EQ(reasons["depth image not 16-bit"], 1);
  EXPECT_EQ(reasons["color image not 8-bit"], 1);
  EXPECT_EQ(reasons["wrong image size"], 1);
  EXPECT_EQ(reasons["color and depth differ in size"], 1);
  expect_complete(sequence.output(), 6);
}

TEST(CliRun, SkipsDuplicateAndBackwardTimestamps) {
  const MadeSequence sequence;
  const std::string last = content_of(sequence.path() / "rgb.txt");
  const std::string line = last.substr(last.rfind('\n', last.size() - 2) + 1);
  sequence.append("rgb.txt", line + "0.01 rgb/again.png\n");
  EXPECT_EQ(run(sequence).code, 0);
  const nlohmann::json reasons = summary(sequence.output())["frames"]["skipped"]["reasons"];
  EXPECT_EQ(reasons["duplicate timestamp"], 1);
  EXPECT_EQ(reasons["backward timestamp"], 1);
  expect_complete(sequence.output(), 10);
}

TEST(CliRun, SaysSoWhenNoFrameCouldBeUsed) {
  const MadeSequence sequence;
  expect_refused(run(sequence, {"--camera", "tum1"}),
                 {sequence.path().string(), "none of its 10 frames", "wrong image size", "--camera"});
  expect_nothing_left(sequence.output());
}

TEST(CliRun, WarnsWhenNoMapCouldBeStarted) {
  const MadeSequence sequence;
  for (int i = 0; i < MadeSequence::kFrames; ++i) {
    sequence.replace("depth", i, cv::Mat::zeros(240, 320, CV_16UC1));
  }
  const Finished finished = run(sequence);
  EXPECT_EQ(finished.code, 0);
  EXPECT_THAT(finished.err, AllOf(StartsWith("warning: no map could be started"), HasSubstr("depth")));
  EXPECT_EQ(std::count(finished.err.begin(), finished.err.end(), '\n'), 1) << finished.err;
  expect_complete(sequence.output(), 0);
  EXPECT_EQ(summary(sequence.output())["frames"]["initializing"], 10);
}

TEST(CliRun, LeavesOutGroundTruthThatIsNoNumberAndSaysSo) {
  const MadeSequence sequence;
  sequence.append("groundtruth.txt", "5.0 nan nan nan 0 0 0 1\n");
  Finished finished = run(sequence);
  EXPECT_EQ(finished.code, 0);
  EXPECT_THAT(finished.err, AllOf(HasSubstr("groundtruth.txt"), HasSubstr("1 line left out")));
  EXPECT_LT(summary(sequence.output())["evaluation"]["ate"]["rmse"], 0.02);

  sequence.write("groundtruth.txt", "0.0 nan nan nan 0 0 0 1\n");
  finished = run(sequence);
  EXPECT_EQ(finished.code, 0) << "the run is as good without ground truth";
  EXPECT_THAT(finished.err, AllOf(HasSubstr("no evaluation"), HasSubstr("groundtruth.txt")));
  EXPECT_TRUE(summary(sequence.output())["evaluation"].is_null());
}

TEST(CliRun, UnwritableOutput) {
  const MadeSequence sequence;
  // Below a file nobody can write, not even root.
  const std::string below_a_file = (sequence.path() / "rgb.txt/run").string();
  for (const std::string& output : {below_a_file, (sequence.path() / "rgb.txt").string(), std::string()}) {
    expect_refused(ipl_slam_program({"run", sequence.path().string(), "-o", output}), {"output"});
  }
  expect_refused(run_program({IPL_SLAM_PROGRAM, "config"}, {}, "/dev/full"), {"standard output"});
}

TEST(CliRun, FullDisk) {
  const MadeSequence sequence;
  const TinyDisk disk("size=32k");
  if (!disk.mounted()) GTEST_SKIP() << "this machine does not let us mount a small file system";
  const fs::path output = disk.path() / "run";
  expect_refused(ipl_slam_program({"run", sequence.path().string(), "-o", output.string()}),
                 {output.string(), "disk full"});
  // Some files may have had room; each is whole, and the summary, written last, is not there.
  EXPECT_FALSE(fs::exists(output / "summary.json"));
  for (const auto& entry : fs::directory_iterator(output)) {
    EXPECT_THAT(entry.path().filename().string(), Not(StartsWith("."))) << "a temporary file was left";
  }
  if (fs::exists(output / "trajectory.txt")) {
    EXPECT_EQ(read_trajectory(output / "trajectory.txt").size(), 10U);
  }
}

TEST(CliRun, UnknownSettingsPresetsCamerasAndOptions) {
  const MadeSequence sequence;
  sequence.write("settings.yaml", "orb:\n  featurs: 1000\n");
  const std::string file = (sequence.path() / "settings.yaml").string();
  expect_refused(run(sequence, {"--config", file}), {file + ":2", "orb.features"});
  expect_refused(run(sequence, {"--config", "nowhere.yaml"}), {"nowhere.yaml"});
  expect_refused(run(sequence, {"--set", "orb.featurs=1000"}), {"did you mean 'orb.features'"});
  expect_refused(run(sequence, {"--set", "orb.features=1"}), {"orb.features", "50"});
  expect_refused(run(sequence, {"--set", "orb.fast_min_threshold=200"}), {"orb.fast_threshold"});
  expect_refused(run(sequence, {"--set", "features.lines=edge"}), {"features.lines", "did you mean 'edges'"});
  expect_refused(run(sequence, {"--preset", "fastest"}), {"fastest", "paper"});
  expect_refused(run(sequence, {"--camera", "tum9"}), {"tum9", "tum1"});
  expect_refused(run(sequence, {"--camera", "nowhere.yaml"}), {"nowhere.yaml"});
  expect_refused(run(sequence, {"--max-frames", "-3"}), {"--max-frames"});
  expect_refused(run(sequence, {"--threads", "0"}), {"--threads"});
  expect_refused(run(sequence, {"--fast"}), {"--fast"});
  expect_refused(run(sequence, {"--associations", "nowhere.txt"}), {"nowhere.txt"});
  fs::remove(sequence.path() / "camera.yaml");
  expect_refused(run(sequence), {sequence.path().string(), "--camera"});
  expect_nothing_left(sequence.output());
}

TEST(CliRun, ANameThatIsNoUtf8DoesNoHarm) {
  const MadeSequence sequence;
  const fs::path odd = sequence.beside(
      "r\xf6"
      "om");
  fs::rename(sequence.path(), odd);
  const Finished finished = ipl_slam_program({"run", odd.string(), "-o", sequence.output().string()});
  EXPECT_EQ(finished.code, 0) << finished.err;
  expect_complete(sequence.output(), 10);
}

TEST(CliRun, CtrlCWritesWhatWasTracked) {
  const MadeSequence sequence;
  sequence.slow_down();
  const Finished finished = interrupt_ipl_slam(
      {"run", sequence.path().string(), "-o", sequence.output().string(), "--realtime"}, "tracking 2/10");
  EXPECT_EQ(finished.code, 130) << finished.err;
  EXPECT_THAT(finished.err, HasSubstr("interrupted"));
  const nlohmann::json json = summary(sequence.output());
  EXPECT_EQ(json["interrupted"], true);
  EXPECT_GE(json["frames"]["tracked"], 2);
  EXPECT_LT(json["frames"]["total"], 10);
  expect_complete(sequence.output(), json["frames"]["tracked"].get<std::size_t>());
}

}  // namespace
}  // namespace ipl_slam
