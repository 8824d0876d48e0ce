// `ipl_slam map`: what is in a saved map.
#include <filesystem>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "dataset/trajectory.hpp"
#include "map/map_file.hpp"
#include "program.hpp"
#include "refused.hpp"
#include "support/eventful_map.hpp"

namespace ipl_slam {
namespace {

using ::testing::AllOf;
using testing::content_of;
using testing::expect_refused;
using testing::Finished;
using ::testing::HasSubstr;
using testing::ipl_slam_program;
using testing::TemporaryFolder;

// A map of two parts in a file of its own.
struct MapOnDisk {
  MapOnDisk() { save_map(file, map, test::kTestCamera); }
  const TemporaryFolder folder;
  const std::string file = (folder / "a.map").string();
  const Map map = test::eventful_map();
};

TEST(CliMap, InfoSaysWhatIsInIt) {
  const MapOnDisk made;
  const Finished text = ipl_slam_program({"map", "info", made.file});
  EXPECT_EQ(text.code, 0) << text.err;
  EXPECT_THAT(text.out, AllOf(HasSubstr("format version 1"), HasSubstr("640x480"), HasSubstr("parts       2"),
                              HasSubstr("loop edges  2")));

  const Finished finished = ipl_slam_program({"map", "info", made.file, "--json"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  const nlohmann::json info = nlohmann::json::parse(finished.out);
  EXPECT_EQ(info["bytes"], std::filesystem::file_size(made.file));
  EXPECT_EQ(info["keyframes"], made.map.keyframes().size());
  EXPECT_EQ(info["points"], made.map.points().size());
  EXPECT_EQ(info["lines"], made.map.lines().size());
  ASSERT_EQ(info["parts"].size(), 2U);
  std::size_t keyframes = 0, points = 0, lines = 0;
  for (const auto& part : info["parts"]) {
    keyframes += part["keyframes"].get<std::size_t>();
    points += part["points"].get<std::size_t>();
    lines += part["lines"].get<std::size_t>();
    EXPECT_LE(part["first_time"], part["last_time"]);
  }
  EXPECT_EQ(keyframes, made.map.keyframes().size());
  EXPECT_EQ(points, made.map.points().size());
  EXPECT_EQ(lines, made.map.lines().size());
}

TEST(CliMap, ExportWritesFilesThatOtherProgramsRead) {
  const MapOnDisk made;
  const std::string output = (made.folder / "deep/out").string();
  const Finished finished = ipl_slam_program({"map", "export", made.file, "-o", output});
  ASSERT_EQ(finished.code, 0) << finished.err;
  const auto of = [&](const char* name) { return std::filesystem::path(output) / name; };

  // The larger part stands as data, the other as comments.
  const Trajectory poses = read_trajectory(of("keyframes.txt"));
  std::istringstream lines(content_of(of("keyframes.txt")));
  std::size_t comments = 0;
  for (std::string line; std::getline(lines, line);) comments += line.starts_with("# part 1: ") ? 1 : 0;
  EXPECT_EQ(poses.size() + comments, made.map.keyframes().size());
  EXPECT_GT(poses.size(), comments);
  EXPECT_GT(comments, 0U);

  const nlohmann::json graph = nlohmann::json::parse(content_of(of("graph.json")));
  EXPECT_EQ(graph["keyframes"].size(), made.map.keyframes().size());
  EXPECT_EQ(graph["loops"].size(), 2U);
  ASSERT_FALSE(graph["covisibility"].empty());
  const Map loaded = load_map(made.file).map;
  std::size_t pairs = 0;
  loaded.keyframes().for_each([&](KeyframeId id, const Keyframe&) { pairs += loaded.covisible(id).size(); });
  EXPECT_EQ(graph["covisibility"].size(), pairs / 2) << "each pair once";

  const std::string points = content_of(of("points.ply"));
  EXPECT_THAT(points, HasSubstr("element vertex " + std::to_string(made.map.points().size()) + "\n"));
  const std::string body = points.substr(points.find("end_header\n") + 11);
  EXPECT_EQ(static_cast<std::size_t>(std::count(body.begin(), body.end(), '\n')), made.map.points().size());
  EXPECT_THAT(content_of(of("lines.ply")),
              HasSubstr("element edge " + std::to_string(made.map.lines().size()) + "\n"));
  EXPECT_FALSE(cv::imread(of("map.png").string()).empty());
}

TEST(CliMap, AnEmptyMapIsNoError) {
  const TemporaryFolder folder;
  const std::string file = (folder / "a.map").string(), output = (folder / "out").string();
  save_map(file, Map(test::kTestPyramid), test::kTestCamera);
  EXPECT_EQ(ipl_slam_program({"map", "info", file}).code, 0);
  EXPECT_EQ(ipl_slam_program({"map", "info", file, "--json"}).code, 0);
  const Finished finished = ipl_slam_program({"map", "export", file, "-o", output});
  EXPECT_EQ(finished.code, 0) << finished.err;
}

TEST(CliMap, RefusesWhatIsNoMap) {
  const MapOnDisk made;
  const std::string content = content_of(made.file);
  const std::string cut = made.folder.write("cut.map", content.substr(0, content.size() / 2)).string();
  const std::string text = made.folder.write("text.map", "dear diary").string();
  for (const char* verb : {"info", "export"}) {
    const auto call = [&](const std::string& file) {
      std::vector<std::string> words{"map", verb, file};
      if (verb == std::string("export")) words.insert(words.end(), {"-o", (made.folder / "out").string()});
      return ipl_slam_program(words);
    };
    expect_refused(call(cut), {cut, "cut short"});
    expect_refused(call(text), {text, "no map file"});
    expect_refused(call("nowhere.map"), {"nowhere.map", "check the path"});
  }
  EXPECT_FALSE(std::filesystem::exists(made.folder / "out")) << "nothing is made for a file that is refused";
  expect_refused(ipl_slam_program({"map"}), {"--help"});
  expect_refused(ipl_slam_program({"map", "inof", made.file}), {"inof", "info"});
  expect_refused(ipl_slam_program({"map", "export", made.file}), {"--output"});
  expect_refused(ipl_slam_program({"map", "export", made.file, "-o", made.file + "/x"}), {"a.map/x"});
}

}  // namespace
}  // namespace ipl_slam
