// The dense cloud as its users meet it: `run`, `map export` and `bench cloud`.
#include <algorithm>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "dense/octomap_file.hpp"
#include "dense/written_files.hpp"
#include "made_sequence.hpp"
#include "program.hpp"
#include "refused.hpp"
#include "tiny_disk.hpp"

namespace ipl_slam {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using testing::content_of;
using ::testing::EndsWith;
using testing::expect_refused;
using testing::Finished;
using ::testing::HasSubstr;
using testing::interrupt_ipl_slam;
using testing::ipl_slam_program;
using ::testing::IsEmpty;
using testing::MadeSequence;
using ::testing::Not;
using testing::parse_written_pcd;
using testing::parse_written_ply;
using testing::run_program;
using testing::TinyDisk;
using testing::WrittenPly;

using Words = std::vector<std::string>;

constexpr const char* kOptional[] = {"cloud.pcd", "mesh.ply", "map.pgm", "map.yaml", "map.bt"};

Words run_words(const MadeSequence& sequence, const Words& more) {
  Words words{"run", sequence.path().string(), "-o", sequence.output().string()};
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

Finished run(const MadeSequence& sequence, const Words& more = {}) {
  return ipl_slam_program(run_words(sequence, more));
}

// Fails the test where the run does.
std::string output_of(const MadeSequence& sequence, const Words& more = {}) {
  const Finished finished = run(sequence, more);
  EXPECT_EQ(finished.code, 0) << finished.err;
  return finished.out;
}

WrittenPly ply_of(const fs::path& file) {
  return parse_written_ply(content_of(file));
}

std::size_t points_of(const WrittenPly& ply) {
  const auto x = ply.vertices.find("x");
  return x == ply.vertices.end() ? 0 : x->second.size();
}

nlohmann::json json_of(const fs::path& file) {
  return nlohmann::json::parse(content_of(file));
}

nlohmann::json cloud_summary(const MadeSequence& sequence) {
  return json_of(sequence.output() / "summary.json")["cloud"];
}

void expect_none_of_the_optional(const fs::path& output) {
  for (const char* name : kOptional) EXPECT_FALSE(fs::exists(output / name)) << name;
  EXPECT_FALSE(fs::exists(output / "keyframes"));
}

void expect_no_temporary_files(const fs::path& output) {
  for (const auto& entry : fs::recursive_directory_iterator(output)) {
    EXPECT_THAT(entry.path().filename().string(), Not(::testing::StartsWith("."))) << entry.path();
  }
}

/// A run with everything that `map export` wants, saved beside it.
struct SavedRun {
  SavedRun() { (void)output_of(sequence, {"--masks", masks, "--save-map", map, "--save-keyframes"}); }

  [[nodiscard]] Finished export_to(const char* name, const Words& more) const {
    Words words{"map", "export", map, "-o", sequence.beside(name).string()};
    words.insert(words.end(), more.begin(), more.end());
    return ipl_slam_program(words);
  }

  const MadeSequence sequence;
  const std::string masks = sequence.path().string(), map = sequence.beside("room.map").string(),
                    keyframes = (sequence.output() / "keyframes").string();
};

TEST(CliCloud, IsAmongTheResultsOfARun) {
  const MadeSequence sequence;
  const std::string text = output_of(sequence, {"--masks", sequence.path().string()});
  const WrittenPly ply = ply_of(sequence.output() / "cloud.ply");
  const std::size_t points = points_of(ply);
  ASSERT_GT(points, 10000U) << "a room at a point per cm";
  const nlohmann::json summary = cloud_summary(sequence);
  EXPECT_EQ(summary["points"], points);
  EXPECT_EQ(summary["keyframes"], json_of(sequence.output() / "summary.json")["map"]["keyframes"]);
  EXPECT_THAT(text, AllOf(HasSubstr(fmt::format("cloud of {} points", points)), HasSubstr("fusing ")));

  // Labels mean the same in the points, in the head and in the list of objects.
  const nlohmann::json listed = json_of(sequence.output() / "objects.json");
  ASSERT_FALSE(listed["objects"].empty());
  EXPECT_EQ(listed["objects"].size(), summary["objects"]);
  std::map<int, std::string> names;
  for (const nlohmann::json& entry : listed["legend"]) {
    names[entry["label"]] = entry["class"];
    EXPECT_THAT(ply.comments,
                Contains(::testing::StartsWith(fmt::format("label {} {} ", entry["label"].get<int>(),
                                                           entry["class"].get<std::string>()))));
  }
  const std::vector<double>& labels = ply.vertices.at("label");
  EXPECT_EQ(static_cast<std::size_t>(
                std::count_if(labels.begin(), labels.end(), [](double label) { return label >= 0; })),
            summary["labelled"]);
  for (const double label : labels) ASSERT_TRUE(label < 0 || names.contains(static_cast<int>(label)));
  for (const nlohmann::json& object : listed["objects"]) EXPECT_EQ(object["class"], names[object["label"]]);
  EXPECT_THAT(names, Contains(::testing::Pair(::testing::_, "tv"))) << "one is in the picture";

  expect_none_of_the_optional(sequence.output());
  expect_no_temporary_files(sequence.output());
}

TEST(CliCloud, IsTheSameBytesTwice) {
  const MadeSequence sequence;
  std::vector<std::string> bytes;
  for (const char* threads : {"1", "2"}) {
    (void)output_of(sequence, {"--threads", threads});
    bytes.push_back(content_of(sequence.output() / "cloud.ply"));
  }
  EXPECT_TRUE(bytes[0] == bytes[1]);  // not EXPECT_EQ: megabytes would be printed
}

TEST(CliCloud, ComesInTheFormatsThatAreAskedForAndTheyGoWithTheNextRun) {
  const MadeSequence sequence;
  const fs::path output = sequence.output();
  Words all{"--pcd", "--mesh", "--occupancy", "--save-keyframes"};
  if (has_octomap()) all.emplace_back("--octomap");
  (void)output_of(sequence, all);

  const WrittenPly cloud = ply_of(output / "cloud.ply");
  const auto pcd = parse_written_pcd(content_of(output / "cloud.pcd"));
  EXPECT_EQ(pcd.head.at("POINTS"), std::to_string(points_of(cloud)));
  const WrittenPly mesh = ply_of(output / "mesh.ply");
  EXPECT_GT(mesh.faces.size(), 10000U);
  for (const std::vector<int>& face : mesh.faces) {
    ASSERT_EQ(face.size(), 3U);
    for (const int vertex : face) ASSERT_LT(static_cast<std::size_t>(vertex), points_of(mesh));
  }
  const cv::Mat plan = cv::imread((output / "map.pgm").string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(plan.type(), CV_8UC1);
  EXPECT_GT(cv::countNonZero(plan == 0), 10) << "walls";
  EXPECT_GT(cv::countNonZero(plan == 254), 100) << "floor";
  EXPECT_THAT(content_of(output / "map.yaml"), AllOf(HasSubstr("image: map.pgm\n"), HasSubstr("resolution")));
  EXPECT_EQ(fs::exists(output / "map.bt"), has_octomap());
  if (has_octomap()) {
    EXPECT_THAT(content_of(output / "map.bt"), ::testing::StartsWith("# Octomap OcTree binary file\n"));
  }
  EXPECT_TRUE(fs::exists(output / "keyframes/keyframes.json"));
  expect_no_temporary_files(output);

  (void)output_of(sequence);
  EXPECT_TRUE(fs::exists(output / "cloud.ply"));
  expect_none_of_the_optional(output);
}

TEST(CliCloud, AnOctomapIsRefusedBeforeTrackingWhereNoneCanBeWritten) {
  if (has_octomap()) GTEST_SKIP() << "this build has OctoMap (dense.WithoutOctomap covers the other)";
  const MadeSequence sequence;
  const Finished finished = run(sequence, {"--octomap"});
  expect_refused(finished, {"OctoMap", "liboctomap"});
  EXPECT_THAT(finished.out, Not(HasSubstr("tracking")));
  EXPECT_FALSE(fs::exists(sequence.output()));
}

TEST(CliCloud, WearsTheColoursOfClassesWhereAskedTo) {
  const MadeSequence sequence;
  (void)output_of(sequence, {"--masks", sequence.path().string(), "--label-colors"});
  std::map<int, std::vector<int>> colors;
  const nlohmann::json listed = json_of(sequence.output() / "objects.json");
  for (const nlohmann::json& entry : listed["legend"]) {
    colors[entry["label"]] = entry["color"].get<std::vector<int>>();
  }
  const WrittenPly ply = ply_of(sequence.output() / "cloud.ply");
  std::size_t labelled = 0;
  for (std::size_t i = 0; i < points_of(ply); ++i) {
    const int label = static_cast<int>(ply.vertices.at("label")[i]);
    if (label < 0) continue;
    ++labelled;
    const std::vector<int>& wanted = colors.at(label);
    ASSERT_EQ(ply.vertices.at("red")[i], wanted[0]);
    ASSERT_EQ(ply.vertices.at("green")[i], wanted[1]);
    ASSERT_EQ(ply.vertices.at("blue")[i], wanted[2]);
  }
  EXPECT_GT(labelled, 1000U);
}

TEST(CliCloud, IsNotMadeWhereSwitchedOff) {
  const MadeSequence sequence;
  (void)output_of(sequence);
  const std::string text = output_of(sequence, {"--set", "dense.enabled=false"});
  EXPECT_THAT(text, AllOf(Not(HasSubstr("cloud")), Not(HasSubstr("fusing"))));
  EXPECT_FALSE(fs::exists(sequence.output() / "cloud.ply")) << "that of the run before would lie";
  EXPECT_FALSE(fs::exists(sequence.output() / "objects.json"));
  EXPECT_TRUE(cloud_summary(sequence).is_null());
}

TEST(CliCloud, WhatIsMadeOfItIsRefusedWhereItIsSwitchedOff) {
  const MadeSequence sequence;
  for (const char* option : {"--mesh", "--pcd", "--occupancy", "--label-colors", "--save-keyframes"}) {
    const Finished finished = run(sequence, {"--set", "dense.enabled=false", option});
    expect_refused(finished, {"dense.enabled=false", option});
    EXPECT_FALSE(fs::exists(sequence.output())) << option;
  }
}

TEST(CliCloud, QuietPrintsNoProgressOfIt) {
  const MadeSequence sequence;
  const std::string text = output_of(sequence, {"-q"});
  EXPECT_THAT(text, AllOf(Not(HasSubstr("fusing")), HasSubstr("cloud of ")));
}

TEST(CliCloud, IsMadeAgainFromMapAndKeyframesToTheByte) {
  const SavedRun saved;
  const Finished finished = saved.export_to("again", {"--keyframes", saved.keyframes, "-q"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_THAT(finished.out, IsEmpty()) << "quiet";
  for (const char* name : {"cloud.ply", "objects.json"}) {
    EXPECT_TRUE(content_of(saved.sequence.beside("again") / name) ==
                content_of(saved.sequence.output() / name))
        << name;
  }
  expect_none_of_the_optional(saved.sequence.beside("again"));

  Words all{"--keyframes", saved.keyframes, "--pcd", "--mesh", "--occupancy", "--label-colors"};
  const Finished more = saved.export_to("again", all);
  EXPECT_EQ(more.code, 0) << more.err;
  for (const char* name : {"cloud.pcd", "mesh.ply", "map.pgm", "map.yaml"}) {
    EXPECT_TRUE(fs::exists(saved.sequence.beside("again") / name)) << name;
    EXPECT_THAT(more.err + more.out, HasSubstr(name));
  }
  expect_no_temporary_files(saved.sequence.beside("again"));
}

TEST(CliCloud, ExportOfKeyframesThatDoNotFitWritesNothing) {
  const SavedRun saved;
  const fs::path keyframes = saved.keyframes;
  const auto spoilt = [&](const char* name, const std::function<void(const fs::path&)>& spoil) {
    const fs::path copy = saved.sequence.beside(name);
    fs::copy(keyframes, copy, fs::copy_options::recursive);
    spoil(copy);
    return copy.string();
  };
  const auto with_index = [](const std::string& text) {
    return [text](const fs::path& folder) { std::ofstream(folder / "keyframes.json") << text; };
  };
  nlohmann::json of_another_map = json_of(keyframes / "keyframes.json");
  for (nlohmann::json& keyframe : of_another_map["keyframes"]) keyframe["reference_time"] = 1000.0;
  const std::vector<std::pair<std::string, Words>> cases{
      {saved.sequence.beside("nowhere").string(), {"nowhere", "keyframes.json"}},
      {spoilt("of another map", with_index(of_another_map.dump())),
       {"of another map", "belongs to", saved.map}},
      {spoilt("no json", with_index("{")), {"no json/keyframes.json", "no JSON"}},
      {spoilt("no list", with_index(R"({"version": 1})")), {"no list/keyframes.json", "'keyframes'"}},
      {spoilt("future", with_index(R"({"version": 2})")), {"future/keyframes.json", "version"}},
      {spoilt("of another camera",
              [](const fs::path& folder) {
                std::string text = content_of(folder / "camera.yaml");
                text.replace(text.find("fx: "), 4, "fx: 1");
                std::ofstream(folder / "camera.yaml") << text;
              }),
       {"of another camera/camera.yaml", "fx is 1"}},
      {spoilt("no depth", [](const fs::path& folder) { fs::remove_all(folder / "depth"); }),
       {"no depth/depth/0.000000.png"}},
      {spoilt("cut", [](const fs::path& folder) { fs::resize_file(folder / "rgb/0.000000.jpg", 500); }),
       {"cut/rgb/0.000000.jpg", "JPEG"}}};
  for (const auto& [folder, words] : cases) {
    expect_refused(saved.export_to("out", {"--keyframes", folder}), words);
    EXPECT_FALSE(fs::exists(saved.sequence.beside("out"))) << folder;
  }
}

TEST(CliCloud, ExportRefusesWhatItCannotDoBeforeItWritesAnything) {
  const SavedRun saved;
  for (const char* option : {"--mesh", "--pcd", "--occupancy", "--octomap", "--label-colors"}) {
    expect_refused(saved.export_to("out", {option}), {"--keyframes"});
  }
  expect_refused(saved.export_to("out", {"--keyframes", saved.keyframes, "--set", "dense.volume.voxl=0.02"}),
                 {"dense.volume.voxl", "dense.volume.voxel"});
  expect_refused(saved.export_to("out", {"--set", "dense.volume.voxl=0.02"}), {"dense.volume.voxel"});
  expect_refused(saved.export_to("out", {"--keyframes", saved.keyframes, "--keyframes", saved.keyframes}),
                 {saved.keyframes, "given twice"});
  expect_refused(saved.export_to("out", {"--keyframes", saved.keyframes, "--set", "dense.volume.voxel=0.05"}),
                 {"dense.volume.truncation", "dense.volume.voxel"});
  fs::copy(saved.keyframes, saved.sequence.beside("copied"), fs::copy_options::recursive);
  expect_refused(saved.export_to("copied", {"--keyframes", saved.sequence.beside("copied").string()}),
                 {"copied", "choose another folder"});
  if (!has_octomap()) {
    expect_refused(saved.export_to("out", {"--keyframes", saved.keyframes, "--octomap"}), {"liboctomap"});
  }
  EXPECT_FALSE(fs::exists(saved.sequence.beside("out")));
}

TEST(CliCloud, ExportTakesAwayWhatAnEarlierOneLeft) {
  const SavedRun saved;
  EXPECT_EQ(saved.export_to("out", {"--keyframes", saved.keyframes, "--pcd"}).code, 0);
  EXPECT_TRUE(fs::exists(saved.sequence.beside("out") / "cloud.pcd"));
  EXPECT_EQ(saved.export_to("out", {}).code, 0);
  for (const char* name : {"cloud.ply", "cloud.pcd", "objects.json"}) {
    EXPECT_FALSE(fs::exists(saved.sequence.beside("out") / name)) << name;
  }
}

TEST(CliCloud, ThatCannotBeWrittenCostsNothingElse) {
  const MadeSequence sequence;
  fs::create_directories(sequence.output() / "cloud.ply/in the way");
  const Finished finished = run(sequence);
  EXPECT_EQ(finished.code, 2);
  EXPECT_THAT(finished.err, HasSubstr("cloud.ply"));
  for (const char* name : {"trajectory.txt", "summary.json", "lines.ply"}) {
    EXPECT_TRUE(fs::exists(sequence.output() / name)) << name;
  }
}

TEST(CliCloud, ExportTakesSettings) {
  const SavedRun saved;
  const Finished finished =
      saved.export_to("coarse", {"--keyframes", saved.keyframes, "--set", "dense.volume.voxel=0.02"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  const std::size_t fine = points_of(ply_of(saved.sequence.output() / "cloud.ply")),
                    coarse = points_of(ply_of(saved.sequence.beside("coarse") / "cloud.ply"));
  // A point per voxel that a surface passes: a quarter of them at twice the edge, save for gaps.
  EXPECT_LT(coarse, fine / 2);
  EXPECT_GT(coarse, fine / 8);
}

TEST(CliCloud, GoesOnWithALoadedMap) {
  const SavedRun saved;
  const MadeSequence& sequence = saved.sequence;
  const MadeSequence second(20);
  const std::string map = second.beside("both.map").string();
  (void)output_of(second, {"--load-map", saved.map, "--save-map", map, "--save-keyframes"});
  const nlohmann::json cloud = cloud_summary(second);
  ASSERT_GT(cloud["keyframes"], 0) << "the second run saw more than the first";
  EXPECT_GT(points_of(ply_of(second.output() / "cloud.ply")), 1000U);

  // Both runs' keyframes with the map of both give one cloud.
  const fs::path out = sequence.beside("both");
  const Finished finished =
      ipl_slam_program({"map", "export", map, "-o", out.string(), "--keyframes", saved.keyframes,
                        "--keyframes", (second.output() / "keyframes").string()});
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_GT(points_of(ply_of(out / "cloud.ply")), points_of(ply_of(second.output() / "cloud.ply")));
}

TEST(CliCloud, LocalizingMakesNone) {
  const SavedRun saved;
  (void)output_of(saved.sequence, {"--load-map", saved.map, "--localize-only"});
  EXPECT_TRUE(cloud_summary(saved.sequence).is_null());
  EXPECT_FALSE(fs::exists(saved.sequence.output() / "cloud.ply"));
  expect_none_of_the_optional(saved.sequence.output());
  expect_refused(run(saved.sequence, {"--load-map", saved.map, "--localize-only", "--mesh"}),
                 {"--localize-only", "--mesh"});
}

TEST(CliCloud, WithoutAMapIsEmptyAndNoError) {
  const MadeSequence sequence;
  for (int i = 0; i < MadeSequence::kFrames; ++i) {
    sequence.replace("depth", i, cv::Mat::zeros(240, 320, CV_16UC1));
  }
  const Finished finished = run(sequence, {"--pcd", "--mesh", "--occupancy", "--save-keyframes"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_THAT(finished.err, AllOf(HasSubstr("no map could be started"), HasSubstr("no floor plan")));
  EXPECT_EQ(points_of(ply_of(sequence.output() / "cloud.ply")), 0U);
  EXPECT_EQ(points_of(ply_of(sequence.output() / "mesh.ply")), 0U);
  EXPECT_EQ(json_of(sequence.output() / "objects.json")["objects"].size(), 0U);
  EXPECT_EQ(cloud_summary(sequence)["points"], 0);
  EXPECT_FALSE(fs::exists(sequence.output() / "map.pgm"));
}

TEST(CliCloud, CtrlCLeavesThatOfWhatWasSeen) {
  const MadeSequence sequence;
  sequence.slow_down();
  const Finished finished =
      interrupt_ipl_slam(run_words(sequence, {"--realtime", "--pcd", "--save-keyframes"}), "tracking 2/10");
  EXPECT_EQ(finished.code, 130) << finished.err;
  const std::size_t points = points_of(ply_of(sequence.output() / "cloud.ply"));
  EXPECT_GT(points, 10000U);
  EXPECT_EQ(cloud_summary(sequence)["points"], points);
  EXPECT_TRUE(fs::exists(sequence.output() / "objects.json"));
  EXPECT_TRUE(fs::exists(sequence.output() / "cloud.pcd"));
  EXPECT_TRUE(fs::exists(sequence.output() / "keyframes/keyframes.json"));
  expect_no_temporary_files(sequence.output());
}

// Runs it with its temporary files in `folder`.
Finished with_temporary_folder(const std::string& folder, Words words) {
  words.insert(words.begin(), {"/usr/bin/env", "TMPDIR=" + folder, IPL_SLAM_PROGRAM});
  return run_program(words);
}

TEST(CliCloud, NoPlaceForTemporaryFilesIsFoundOutBeforeTracking) {
  const SavedRun saved;
  fs::rename(saved.keyframes, saved.sequence.beside("kept"));
  fs::remove_all(saved.sequence.output());
  const std::string a_file = (saved.sequence.path() / "rgb.txt").string();
  // In /proc nobody can make files, not even root.
  for (const std::string& folder :
       {a_file, saved.sequence.beside("nowhere").string(), std::string("/proc")}) {
    const Finished finished = with_temporary_folder(folder, run_words(saved.sequence, {}));
    expect_refused(finished, {"TMPDIR"});
    EXPECT_THAT(finished.out, Not(HasSubstr("tracking")));
    EXPECT_FALSE(fs::exists(saved.sequence.output())) << folder;
    const std::string out = saved.sequence.beside("out").string();
    expect_refused(with_temporary_folder(folder, {"map", "export", saved.map, "-o", out, "--keyframes",
                                                  saved.sequence.beside("kept").string()}),
                   {"TMPDIR"});
    EXPECT_FALSE(fs::exists(out)) << folder;
    // Where no cloud is made none is needed.
    EXPECT_EQ(with_temporary_folder(folder, run_words(saved.sequence, {"--set", "dense.enabled=false"})).code,
              0);
    fs::remove_all(saved.sequence.output());
  }
}

TEST(CliCloud, AFullDiskForTemporaryFilesCostsTheCloudAndNoMore) {
  const TinyDisk disk("size=32k");
  if (!disk.mounted()) GTEST_SKIP() << "this machine does not let us mount a small file system";
  const MadeSequence sequence;
  (void)output_of(sequence);
  for (const Words& more : {Words{}, Words{"--realtime"}}) {
    const Finished finished = with_temporary_folder(disk.path().string(), run_words(sequence, more));
    expect_refused(finished, {"disk full", disk.path().string(), "TMPDIR"});
    const nlohmann::json summary = json_of(sequence.output() / "summary.json");
    EXPECT_GT(summary["frames"]["tracked"], 0);
    EXPECT_TRUE(summary["cloud"].is_null());
    EXPECT_TRUE(fs::exists(sequence.output() / "trajectory.txt"));
    EXPECT_FALSE(fs::exists(sequence.output() / "cloud.ply")) << "that of the run before would lie";
  }
  EXPECT_TRUE(fs::is_empty(disk.path())) << "temporary files are left";
}

// --- bench cloud ---

TEST(CliBenchCloud, MeasuresACloud) {
  const MadeSequence sequence;
  (void)output_of(sequence);
  const std::string path = sequence.path().string(), output = sequence.output().string();
  const Finished text = ipl_slam_program({"bench", "cloud", path, output, "-q"});
  EXPECT_EQ(text.code, 0) << text.err;
  EXPECT_THAT(text.out, AllOf(HasSubstr("points "), HasSubstr("distance "), HasSubstr("completeness "),
                              Not(HasSubstr("ghosts")), Not(HasSubstr("reading"))));

  const Finished plain = ipl_slam_program({"bench", "cloud", path, output, "--json"});
  EXPECT_EQ(plain.code, 0) << plain.err;
  const nlohmann::json figures = nlohmann::json::parse(plain.out);  // alone on stdout
  EXPECT_EQ(figures["points"], points_of(ply_of(sequence.output() / "cloud.ply")));
  // Against depth with the noise of a Kinect, which at this room's 3 m is a centimetre.
  EXPECT_LT(figures["mean_m"], 0.02);
  EXPECT_GT(figures["completeness"], 0.3) << "what is far needs more than the two keyframes of ten frames";
  EXPECT_LT(figures["far_share"], 0.01);
  EXPECT_TRUE(figures["ghost_share"].is_null());

  const Finished masked = ipl_slam_program({"bench", "cloud", path, output, "--json", "--masks", path});
  EXPECT_EQ(masked.code, 0) << masked.err;
  EXPECT_EQ(nlohmann::json::parse(masked.out)["ghost_share"], 0.0) << "nobody is there";

  // What ten frames show of what is near is all there.
  const Finished near = ipl_slam_program({"bench", "cloud", path, output, "--json", "--max-depth", "2.5"});
  EXPECT_GT(nlohmann::json::parse(near.out)["completeness"], 0.9) << near.err;
}

TEST(CliBenchCloud, RefusesWhatCannotBeMeasured) {
  const MadeSequence sequence;
  (void)output_of(sequence);
  const std::string path = sequence.path().string(), output = sequence.output().string();
  const auto bench = [&](const std::string& run_folder, const Words& more = {}) {
    Words words{"bench", "cloud", path, run_folder, "--json"};
    words.insert(words.end(), more.begin(), more.end());
    return ipl_slam_program(words);
  };
  const std::string nowhere = sequence.beside("nowhere").string();
  expect_refused(bench(nowhere), {nowhere, "cloud.ply"});
  expect_refused(bench(output, {"--masks", nowhere}), {nowhere, "masks"});
  expect_refused(bench(output, {"--camera", "tum1"}), {path, "--camera"});
  expect_refused(bench(output, {"--every", "0"}), {"--every"});
  const auto truth = [&](const std::string& text) { sequence.write("groundtruth.txt", text); };
  truth("1000.0 0 0 0 0 0 0 1\n");
  expect_refused(bench(output), {"ground truth"});
  truth("# nobody measured\n");
  expect_refused(bench(output), {"groundtruth.txt"});
  fs::remove(sequence.path() / "groundtruth.txt");
  expect_refused(bench(output), {path, "no ground truth"});
  std::ofstream(sequence.output() / "cloud.ply") << "ply\n";
  truth("0.0 0 0 0 0 0 0 1\n");
  expect_refused(bench(output), {"cloud.ply"});
}

}  // namespace
}  // namespace ipl_slam
