// `ipl_slam run` with maps that are saved and loaded.
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "made_sequence.hpp"
#include "map/map_file.hpp"
#include "program.hpp"
#include "refused.hpp"
#include "support/eventful_map.hpp"

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

Finished run(const MadeSequence& sequence, std::vector<std::string> more) {
  more.insert(more.begin(), {"run", sequence.path().string(), "-o", sequence.output().string()});
  return ipl_slam_program(more);
}

nlohmann::json summary(const MadeSequence& sequence) {
  return nlohmann::json::parse(content_of(sequence.output() / "summary.json"));
}

// The map of the sequence, saved beside it.
std::string saved_map(const MadeSequence& sequence) {
  const std::string file = sequence.beside("room.map").string();
  const Finished finished = run(sequence, {"--save-map", file});
  EXPECT_EQ(finished.code, 0) << finished.err;
  fs::remove_all(sequence.output());
  return file;
}

std::size_t keyframes_in(const std::string& file) {
  return load_map(file).map.keyframes().size();
}

TEST(CliRunMap, ASavedMapHoldsWhatWasMapped) {
  const MadeSequence sequence;
  const std::string file = (sequence.output() / "room.map").string();
  const Finished finished = run(sequence, {"--save-map", file});
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_THAT(finished.err, IsEmpty());
  const nlohmann::json map = summary(sequence)["map"];
  EXPECT_TRUE(map["loaded"].is_null());
  const SavedMap saved = load_map(file);
  EXPECT_EQ(map["keyframes"], saved.map.keyframes().size());
  EXPECT_EQ(map["landmarks"], saved.map.points().size());
  EXPECT_EQ(map["lines"], saved.map.lines().size());
  ASSERT_EQ(map["parts"].size(), 1U);
  EXPECT_EQ(map["parts"][0]["tracked"], 10);
  EXPECT_TRUE(summary(sequence)["places"].is_array());
}

TEST(CliRunMap, GoesOnWithALoadedMap) {
  const MadeSequence sequence;
  const std::string file = saved_map(sequence);
  const std::size_t before = keyframes_in(file);
  const Finished finished = run(sequence, {"--load-map", file, "--save-map", file});
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_THAT(finished.err, IsEmpty());
  const nlohmann::json json = summary(sequence);
  EXPECT_EQ(json["frames"]["tracked"], 10);
  EXPECT_EQ(json["map"]["loaded"], file);
  EXPECT_EQ(json["map"]["localize_only"], false);
  ASSERT_EQ(json["map"]["parts"].size(), 1U) << "it knows where it is at once";
  EXPECT_EQ(json["map"]["parts"][0]["loaded"], true);
  EXPECT_LT(json["evaluation"]["ate"]["rmse"], 0.02);
  EXPECT_GE(keyframes_in(file), before) << "saved onto the file that was loaded";
}

TEST(CliRunMap, LocalizingAddsNothing) {
  const MadeSequence sequence;
  const std::string file = saved_map(sequence), content = content_of(file);
  const Finished finished = run(sequence, {"--load-map", file, "--localize-only", "--save-map", file});
  EXPECT_EQ(finished.code, 0) << finished.err;
  const nlohmann::json json = summary(sequence);
  EXPECT_EQ(json["frames"]["tracked"], 10);
  EXPECT_EQ(json["map"]["localize_only"], true);
  EXPECT_EQ(json["map"]["keyframes"], load_map(file).map.keyframes().size());
  EXPECT_EQ(content_of(file), content);
}

TEST(CliRunMap, LocalizingNeedsAMap) {
  const MadeSequence sequence;
  expect_refused(run(sequence, {"--localize-only"}), {"--localize-only", "--load-map"});
  EXPECT_FALSE(fs::exists(sequence.output()));
}

TEST(CliRunMap, AMapThatCannotBeUsedIsRefusedBeforeAnythingIsTrackedOrMade) {
  const MadeSequence sequence;
  const std::string file = saved_map(sequence), content = content_of(file);
  const auto beside = [&](const char* name, const std::string& bytes) {
    std::ofstream(sequence.beside(name), std::ios::binary) << bytes;
    return sequence.beside(name).string();
  };
  std::string changed = content;
  changed[changed.size() / 2] = static_cast<char>(changed[changed.size() / 2] ^ 1);
  const std::string foreign = sequence.beside("foreign.map").string();
  save_map(foreign, test::eventful_map(), test::kTestCamera);
  const std::string empty = sequence.beside("empty.map").string();
  save_map(empty, Map(test::kTestPyramid), load_map(file).camera);
  const std::vector<std::pair<std::string, std::string>> cases{
      {sequence.beside("nowhere.map").string(), "check the path"},
      {beside("cut.map", content.substr(0, content.size() / 2)), "cut short"},
      {beside("changed.map", changed), "damaged"},
      {beside("text.map", "dear diary"), "no map file"},
      {foreign, "--camera"},
      {empty, "no keyframe"}};
  for (const auto& [map, words] : cases) {
    const Finished finished = run(sequence, {"--load-map", map});
    expect_refused(finished, {map, words});
    EXPECT_THAT(finished.out, Not(HasSubstr("tracking")));
    EXPECT_FALSE(fs::exists(sequence.output())) << map;
  }
  expect_refused(run(sequence, {"--load-map", file, "--set", "orb.levels=4"}), {file, "orb.levels"});
}

TEST(CliRunMap, AMapThatCannotBeWrittenIsFoundOutBeforeTracking) {
  const MadeSequence sequence;
  const std::string below_a_file = (sequence.path() / "rgb.txt/room.map").string();
  const std::string nowhere = sequence.beside("nowhere/room.map").string();
  for (const std::string& file : {below_a_file, nowhere, sequence.path().string(), std::string()}) {
    const Finished finished = run(sequence, {"--save-map", file});
    expect_refused(finished, {file.empty() ? "--save-map" : file});
    EXPECT_THAT(finished.out, Not(HasSubstr("tracking")));
    EXPECT_FALSE(fs::exists(sequence.output()));
  }
}

TEST(CliRunMap, TheResultsAreThereThoughTheMapCouldNotBeSavedInTheEnd) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  const MadeSequence sequence;
  expect_refused(run(sequence, {"--save-map", "/dev/full"}), {"/dev/full", "disk full"});
  EXPECT_EQ(summary(sequence)["frames"]["tracked"], 10);
}

TEST(CliRunMap, CtrlCSavesTheMapOfWhatWasTracked) {
  const MadeSequence sequence;
  sequence.slow_down();
  const std::string file = sequence.beside("room.map").string();
  const Finished finished = interrupt_ipl_slam(
      {"run", sequence.path().string(), "-o", sequence.output().string(), "--realtime", "--save-map", file},
      "tracking 2/10");
  EXPECT_EQ(finished.code, 130) << finished.err;
  ASSERT_TRUE(fs::exists(file));
  EXPECT_EQ(keyframes_in(file), summary(sequence)["map"]["keyframes"]);
}

TEST(CliRunMap, SaysSoWhereNoPlaceOfTheMapIsRecognised) {
  const MadeSequence known, unknown;
  unknown.mirror();
  const std::string file = saved_map(known);
  const Finished localized = run(unknown, {"--load-map", file, "--localize-only"});
  EXPECT_EQ(localized.code, 0);
  EXPECT_THAT(localized.err, AllOf(HasSubstr("warning: no place of '" + file), HasSubstr("empty")));
  EXPECT_EQ(std::count(localized.err.begin(), localized.err.end(), '\n'), 1) << localized.err;
  EXPECT_EQ(summary(unknown)["frames"]["lost"], 10);

  // Frames a second apart: after two of them the camera starts a part of its own.
  unknown.slow_down();
  const Finished anew = run(unknown, {"--load-map", file});
  EXPECT_EQ(anew.code, 0) << anew.err;
  EXPECT_THAT(anew.err, HasSubstr("not in the world of '" + file));
  const nlohmann::json parts = summary(unknown)["map"]["parts"];
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_EQ(parts[0]["loaded"], false);
}

TEST(CliRunMap, WithoutAMapThereIsNothingToSave) {
  const MadeSequence sequence;
  for (int i = 0; i < MadeSequence::kFrames; ++i) {
    sequence.replace("depth", i, cv::Mat::zeros(240, 320, CV_16UC1));
  }
  const std::string file = sequence.beside("room.map").string();
  const Finished finished = run(sequence, {"--save-map", file});
  EXPECT_EQ(finished.code, 0);
  EXPECT_THAT(finished.err, HasSubstr("no map to save"));
  EXPECT_FALSE(fs::exists(file));
}

}  // namespace
}  // namespace ipl_slam
