#include <filesystem>
#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "dataset/synthetic/write_sequence.hpp"
#include "program.hpp"
#include "refused.hpp"
#include "segmentation/onnx_model.hpp"
#include "support/rendered_sequence.hpp"
#include "support/tiny_yolo.hpp"

namespace ipl_slam {
namespace {

namespace fs = std::filesystem;
using testing::content_of;
using testing::expect_refused;
using testing::Finished;
using ::testing::HasSubstr;
using testing::ipl_slam_program;
using testing::TemporaryFolder;

std::size_t files_in(const fs::path& folder) {
  return fs::exists(folder) ? static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), {})) : 0;
}

std::vector<nlohmann::json> lines_of(const fs::path& file) {
  std::vector<nlohmann::json> lines;
  std::istringstream stream(content_of(file));
  for (std::string line; std::getline(stream, line);) lines.push_back(nlohmann::json::parse(line));
  return lines;
}

/// A rendered room with somebody in it.
class Segment : public ::testing::Test {
 protected:
  static constexpr int kFrames = 8;
  static constexpr std::size_t kMark = 1;  // the file that says who made a folder

  Segment() {
    SyntheticOptions options = testing::small_room(kFrames, "static");
    options.people = 1;
    SequenceWriteOptions write;
    write.threads = 2;
    write_sequence(SyntheticSource(options), room(), write);
  }

  [[nodiscard]] std::string room() const { return folder_ / "room"; }
  [[nodiscard]] fs::path output() const { return folder_ / "out"; }
  [[nodiscard]] Finished segment(std::vector<std::string> more) const {
    more.insert(more.begin(), {"segment", room(), "-o", output().string()});
    return ipl_slam_program(more);
  }
  [[nodiscard]] std::string model() const {
    const std::string file = folder_ / "tiny.onnx";
    std::ofstream(file, std::ios::binary) << tiny_yolo();
    return file;
  }
  /// A red rectangle on grey.
  [[nodiscard]] std::string picture() const {
    cv::Mat image(48, 64, CV_8UC3, cv::Scalar(128, 128, 128));
    image(cv::Rect(16, 12, 24, 20)) = cv::Scalar(0, 0, 255);
    const std::string file = folder_ / "red.png";
    cv::imwrite(file, image);
    return file;
  }

  TemporaryFolder folder_;
};

TEST_F(Segment, DrawsAndListsTheInstancesOfASequence) {
  const Finished finished = segment({"--masks", room()});
  ASSERT_EQ(finished.code, 0) << finished.err;
  EXPECT_EQ(files_in(output() / "overlays"), kFrames + kMark);
  const std::vector<nlohmann::json> lines = lines_of(output() / "instances.jsonl");
  ASSERT_EQ(lines.size(), static_cast<std::size_t>(kFrames));
  EXPECT_FALSE(lines[0]["instances"].empty());
  EXPECT_FALSE(lines[0]["instances"][0].contains("state")) << "nobody has judged";
  EXPECT_THAT(finished.out, HasSubstr("time per image, ms"));
}

TEST_F(Segment, ComparesWithTrueMasks) {
  const Finished finished = segment({"--masks", room(), "--truth", room(), "--truth-min-area", "0"});
  ASSERT_EQ(finished.code, 0) << finished.err;
  EXPECT_THAT(finished.out, HasSubstr("recall 1.000, precision 1.000")) << "masks compared with themselves";
}

TEST_F(Segment, SavesMasksThatItReadsBackTheSame) {
  ASSERT_EQ(segment({"--masks", room(), "--save-masks"}).code, 0);
  const fs::path saved = folder_ / "saved";
  fs::rename(output() / "masks", saved);
  EXPECT_EQ(files_in(saved), 2U * kFrames + kMark) << "a label image and a class list per frame";
  const std::string journal = content_of(output() / "instances.jsonl");
  ASSERT_EQ(segment({"--masks", saved.string()}).code, 0);
  EXPECT_EQ(content_of(output() / "instances.jsonl"), journal) << "other boxes, classes, scores or ids";
}

TEST_F(Segment, SaysSoWhereTheTruthIsThatOfAnotherSequence) {
  const fs::path other = folder_ / "other";
  fs::create_directories(other);
  cv::imwrite((other / "99.000000.png").string(), cv::Mat(240, 320, CV_8UC1, cv::Scalar(1)));
  const Finished finished = segment({"--masks", room(), "--truth", other.string(), "--truth-min-area", "0"});
  EXPECT_EQ(finished.code, 0);
  EXPECT_THAT(finished.out, HasSubstr("over the 0 frames"));
  EXPECT_THAT(finished.err, HasSubstr(other.string()));
}

TEST_F(Segment, TouchesNoFileOfItsUser) {
  ASSERT_EQ(segment({"--masks", room()}).code, 0);
  EXPECT_EQ(files_in(output() / "overlays"), kFrames + kMark);
  const fs::path mine = output() / "overlays" / "mine.txt";
  std::ofstream(mine) << "mine";
  ASSERT_EQ(segment({"--masks", room(), "--max-frames", "3"}).code, 0);
  EXPECT_EQ(files_in(output() / "overlays"), 3 + kMark + 1) << "pictures of the run before are replaced";
  ASSERT_EQ(ipl_slam_program({"run", room(), "-o", output().string(), "--segmenter", "none"}).code, 0);
  EXPECT_EQ(content_of(mine), "mine");
  EXPECT_EQ(files_in(output() / "overlays"), kMark + 1);
}

TEST_F(Segment, DoesNotWriteIntoTheSequenceNorWhereSomethingElseStands) {
  const std::size_t masks = files_in(room() + "/masks");
  expect_refused(ipl_slam_program({"segment", room(), "-o", room(), "--save-masks"}), {room(), "-o"});
  expect_refused(ipl_slam_program({"run", room(), "-o", room()}), {room(), "-o"});
  EXPECT_EQ(files_in(room() + "/masks"), masks);
  fs::create_directories(output() / "masks");
  std::ofstream(output() / "masks" / "000000.000000.png") << "mine";
  expect_refused(segment({"--masks", room(), "--save-masks"}), {(output() / "masks").string()});
  EXPECT_EQ(files_in(output() / "masks"), 1U);
}

TEST_F(Segment, NeedsNoNetworkByDefault) {
  const Finished finished = segment({});
  ASSERT_EQ(finished.code, 0) << finished.err;
  EXPECT_THAT(finished.out, HasSubstr("found by geometric"));
}

TEST_F(Segment, FindsWhatANetworkSeesInAPicture) {
  if (!has_onnx_runtime()) GTEST_SKIP() << "built without ONNX Runtime";
  const Finished finished =
      ipl_slam_program({"segment", picture(), "--model", model(), "-o", output().string()});
  ASSERT_EQ(finished.code, 0) << finished.err;
  EXPECT_THAT(finished.out, HasSubstr("red thing"));
  EXPECT_THAT(finished.out, HasSubstr("inference"));
  EXPECT_FALSE(cv::imread((output() / "red_instances.jpg").string()).empty());
}

TEST_F(Segment, RefusesWhatCannotBe) {
  expect_refused(ipl_slam_program({"segment", picture(), "-o", output().string()}), {"red.png", "--model"});
  expect_refused(segment({"--segmenter", "none"}), {"--segmenter none"});
  expect_refused(segment({"--segmenter", "geometric", "--masks", room()}), {"--segmenter geometric", room()});
  expect_refused(segment({"--segmenter", "yolo"}), {"--model"});
  expect_refused(segment({"--model", "/nowhere/model.onnx"}), {"/nowhere/model.onnx"});
  expect_refused(segment({"--masks", "/nowhere"}), {"/nowhere"});
  expect_refused(segment({"--masks", room(), "--truth", "/nowhere"}), {"/nowhere"});
  expect_refused(ipl_slam_program({"segment", "/nowhere", "-o", output().string()}),
                 {"/nowhere", "image or folder"});
  expect_refused(
      ipl_slam_program({"segment", picture(), "--model", model(), "--save-masks", "-o", output().string()}),
      {"--save-masks"});
  expect_refused(ipl_slam_program({"run", room(), "--segmenter", "yolo", "-o", output().string()}),
                 {"--model"});
  EXPECT_FALSE(fs::exists(output())) << "nothing may be left behind";
}

TEST_F(Segment, RunLeavesAJournalOfInstancesAndPicturesWhereAskedTo) {
  const auto run = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"run", room(), "-o", output().string()});
    return ipl_slam_program(more);
  };
  ASSERT_EQ(run({"--masks", room(), "--save-overlays"}).code, 0);
  EXPECT_EQ(files_in(output() / "overlays"), kFrames + kMark);
  EXPECT_FALSE(fs::exists(output() / "overlays.part"));
  const std::vector<nlohmann::json> lines = lines_of(output() / "instances.jsonl");
  ASSERT_EQ(lines.size(), static_cast<std::size_t>(kFrames));
  EXPECT_EQ(lines[0]["instances"][0]["state"], "candidate");
  const auto summary = nlohmann::json::parse(content_of(output() / "summary.json"));
  EXPECT_EQ(summary["instances"]["segmenter"], "masks");
  EXPECT_EQ(summary["instances"]["mask_age_frames"]["max"], 0.0);

  ASSERT_EQ(run({"--segmenter", "none"}).code, 0);
  EXPECT_FALSE(fs::exists(output() / "instances.jsonl")) << "of the run before";
  EXPECT_FALSE(fs::exists(output() / "overlays")) << "of the run before";
  EXPECT_TRUE(nlohmann::json::parse(content_of(output() / "summary.json"))["instances"].is_null());
}

}  // namespace
}  // namespace ipl_slam
