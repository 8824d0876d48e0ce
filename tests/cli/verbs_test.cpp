#include <algorithm>
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "program.hpp"
#include "refused.hpp"

namespace ipl_slam {
namespace {

using ::testing::AllOf;
using testing::content_of;
using testing::expect_refused;
using testing::Finished;
using ::testing::HasSubstr;
using testing::ipl_slam_program;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::TemporaryFolder;

/// A straight walk of 40 poses, with `offset` metres of error in every second one.
std::string walk(double offset, double start = 0.0) {
  std::string text;
  for (int i = 0; i < 40; ++i) {
    text += std::to_string(start + 0.1 * i) + ' ' + std::to_string(0.05 * i) + ' ' +
            std::to_string(i % 2 == 0 ? 0.0 : offset) + ' ' + std::to_string(0.01 * i * i) + " 0 0 0 1\n";
  }
  return text;
}

TEST(CliVerbs, NoneOrAnUnknownOneIsExplained) {
  const Finished help = ipl_slam_program({});
  EXPECT_EQ(help.code, 0);
  for (const char* verb : {"run", "segment", "eval", "map", "synth", "config", "bench"}) {
    EXPECT_THAT(help.out, HasSubstr(verb));
    const Finished of_verb = ipl_slam_program({verb, "--help"});
    EXPECT_EQ(of_verb.code, 0) << verb;
    EXPECT_THAT(of_verb.out, HasSubstr("Usage: ipl_slam")) << verb;
  }
  expect_refused(ipl_slam_program({"rnu"}), {"did you mean 'run'"});
  expect_refused(ipl_slam_program({"--quiet"}), {"no verb"});
  expect_refused(ipl_slam_program({"run"}), {"sequence", "--help"});
  expect_refused(ipl_slam_program({"eval", "--nonsense"}), {"--help"});
}

TEST(CliEval, PrintsATableAndForSeveralTheirMean) {
  const TemporaryFolder folder;
  const std::string truth = folder.write("truth.txt", walk(0.0)), a = folder.write("a.txt", walk(0.01)),
                    b = folder.write("b.txt", walk(0.02));
  const Finished one = ipl_slam_program({"eval", truth, a});
  EXPECT_EQ(one.code, 0) << one.err;
  EXPECT_THAT(one.out, AllOf(HasSubstr("ATE [m]"), HasSubstr("40 of 40 poses")));
  const Finished two = ipl_slam_program({"eval", truth, a, b});
  EXPECT_EQ(two.code, 0) << two.err;
  EXPECT_THAT(two.out, AllOf(HasSubstr("mean of 2"), HasSubstr("a.txt"), HasSubstr("b.txt")));
}

TEST(CliEval, JsonOnStdoutStandsAlone) {
  const TemporaryFolder folder;
  const std::string truth = folder.write("truth.txt", walk(0.0)), a = folder.write("a.txt", walk(0.01)),
                    b = folder.write("b.txt", walk(0.02));
  const Finished finished = ipl_slam_program({"eval", truth, a, b, "--json", "-"});
  EXPECT_EQ(finished.code, 0);
  const nlohmann::json json = nlohmann::json::parse(finished.out);
  EXPECT_EQ(json["trajectories"].size(), 2U);
  EXPECT_TRUE(json.contains("summary"));

  const std::string file = (folder / "figures.json").string();
  EXPECT_EQ(ipl_slam_program({"eval", truth, a, b, "--json", file}).code, 0);
  EXPECT_EQ(nlohmann::json::parse(content_of(file)), json);
}

TEST(CliEval, SaysHowManyLinesItLeftOut) {
  const TemporaryFolder folder;
  const std::string truth = folder.write("truth.txt", walk(0.0) + "9 nan 0 0 0 0 0 1\n9.1 0 0 0 0 0 0 0\n"),
                    a = folder.write("a.txt", walk(0.01));
  const Finished finished = ipl_slam_program({"eval", truth, a});
  EXPECT_EQ(finished.code, 0);
  EXPECT_THAT(finished.err, AllOf(HasSubstr("truth.txt"), HasSubstr("2 lines left out")));
}

TEST(CliEval, RefusesFilesThatDoNotBelongTogetherOrAreNone) {
  const TemporaryFolder folder;
  const std::string truth = folder.write("truth.txt", walk(0.0)),
                    later = folder.write("later.txt", walk(0.0, 1e6)),
                    other = folder.write("camera.yaml", "fx: 500\n"), empty = folder.write("empty.txt", "");
  expect_refused(ipl_slam_program({"eval", truth, later}), {"later.txt", "same sequence"});
  expect_refused(ipl_slam_program({"eval", truth, other}), {"camera.yaml:1", "fx: 500"});
  expect_refused(ipl_slam_program({"eval", truth, empty}), {"empty.txt", "no pose"});
  expect_refused(ipl_slam_program({"eval", truth, folder.path().string()}), {"folder"});
  expect_refused(ipl_slam_program({"eval", truth, "nowhere.txt"}), {"nowhere.txt"});
  expect_refused(ipl_slam_program({"eval", truth}), {"trajectory"});
  const std::string below_a_file = truth + "/figures.json";
  expect_refused(ipl_slam_program({"eval", truth, truth, "--json", below_a_file}), {below_a_file});
  expect_refused(ipl_slam_program({"eval", truth, truth, "--plot", (folder / "plot.abc").string()}),
                 {".abc"});
  EXPECT_FALSE(std::filesystem::exists(folder / "plot.abc"));
}

TEST(CliConfig, PrintsWhatItReadsBack) {
  const TemporaryFolder folder;
  const Finished printed = ipl_slam_program({"config", "--preset", "paper"});
  EXPECT_EQ(printed.code, 0);
  const std::string file = folder.write("settings.yaml", printed.out);
  const Finished again = ipl_slam_program({"config", "--preset", "paper", "--config", file});
  EXPECT_EQ(again.code, 0) << again.err;
  EXPECT_EQ(again.out, printed.out);
}

TEST(CliSynth, RefusesAFolderThatIsThereAndWhatCannotBe) {
  const TemporaryFolder folder;
  folder.write("mine/notes.txt", "dear diary");
  const std::string mine = (folder / "mine").string();
  expect_refused(ipl_slam_program({"synth", mine}), {mine, "--force"});
  expect_refused(ipl_slam_program({"synth", mine, "--force"}), {mine, "not replaced"});
  expect_refused(ipl_slam_program({"synth", (folder / "new").string(), "--trajectory", "spiral"}),
                 {"spiral"});
  expect_refused(ipl_slam_program({"synth", (folder / "new").string(), "--frames", "0"}), {"frames"});
  EXPECT_THAT(content_of(folder / "mine/notes.txt"), Not(IsEmpty()));
  EXPECT_EQ(folder.names().size(), 1U) << "nothing half-made is left";
}

}  // namespace
}  // namespace ipl_slam
