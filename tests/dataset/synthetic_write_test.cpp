#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <yaml-cpp/yaml.h>

#include <ipl_slam/error.hpp>

#include "dataset/synthetic/write_sequence.hpp"

namespace ipl_slam {
namespace {

namespace fs = std::filesystem;

std::string content(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

std::map<std::string, std::string> contents(const fs::path& folder) {
  std::map<std::string, std::string> result;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) result[fs::relative(entry.path(), folder).string()] = content(entry.path());
  }
  return result;
}

class WriteSequence : public ::testing::Test {
 protected:
  WriteSequence() {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    root_ = fs::temp_directory_path() / ("ipl_slam_write_sequence_" + std::string(test->name()));
    fs::remove_all(root_);
    fs::create_directories(root_);
    options_.width = 96;
    options_.height = 72;
    options_.frames = 4;
    options_.people = 1;
  }
  ~WriteSequence() override { fs::remove_all(root_); }

  fs::path root_;
  SyntheticOptions options_;
};

TEST_F(WriteSequence, StoresWhatTheSourceRenders) {
  const SyntheticSource source(options_);
  std::size_t done = 0;
  SequenceWriteOptions write;
  write.frame_done = [&done] { ++done; };
  write_sequence(source, root_ / "seq", write);
  EXPECT_EQ(done, 4U);

  std::ifstream associations(root_ / "seq" / "associations.txt");
  std::ifstream truth(root_ / "seq" / "groundtruth.txt");
  std::string comment;
  std::getline(truth, comment);
  EXPECT_EQ(comment.front(), '#');
  for (std::size_t i = 0; i < 4; ++i) {
    const SyntheticFrame frame = source.render(i);
    double rgb_time = 0;
    double depth_time = 0;
    std::string rgb, depth;
    ASSERT_TRUE(associations >> rgb_time >> rgb >> depth_time >> depth);
    EXPECT_EQ(rgb_time, frame.rgbd.timestamp);
    EXPECT_EQ(depth_time, frame.rgbd.timestamp);
    const cv::Mat color = cv::imread((root_ / "seq" / rgb).string(), cv::IMREAD_UNCHANGED);
    const cv::Mat raw = cv::imread((root_ / "seq" / depth).string(), cv::IMREAD_UNCHANGED);
    const cv::Mat mask =
        cv::imread((root_ / "seq" / "masks" / fs::path(rgb).filename()).string(), cv::IMREAD_UNCHANGED);
    ASSERT_EQ(color.type(), CV_8UC3);
    ASSERT_EQ(raw.type(), CV_16UC1);
    ASSERT_EQ(mask.type(), CV_8UC1);
    EXPECT_EQ(cv::norm(color, frame.rgbd.color, cv::NORM_INF), 0.0);
    EXPECT_EQ(cv::norm(raw, frame.rgbd.depth, cv::NORM_INF), 0.0);
    EXPECT_EQ(cv::norm(mask, frame.mask, cv::NORM_INF), 0.0);

    double t, x, y, z, qx, qy, qz, qw;
    ASSERT_TRUE(truth >> t >> x >> y >> z >> qx >> qy >> qz >> qw);
    const SE3 T_wc(Eigen::Quaterniond(qw, qx, qy, qz), Eigen::Vector3d(x, y, z));
    EXPECT_EQ(t, frame.rgbd.timestamp);
    EXPECT_LT((T_wc.inverse() * frame.T_wc).log().norm(), 1e-8);  // nine decimals are stored
  }
}

TEST_F(WriteSequence, DescribesCameraAndObjects) {
  const SyntheticSource source(options_);
  write_sequence(source, root_ / "seq", {});
  const YAML::Node camera = YAML::LoadFile((root_ / "seq" / "camera.yaml").string());
  EXPECT_EQ(camera["width"].as<int>(), 96);
  EXPECT_EQ(camera["height"].as<int>(), 72);
  EXPECT_EQ(camera["fx"].as<double>(), source.camera().fx);
  EXPECT_EQ(camera["cy"].as<double>(), source.camera().cy);
  EXPECT_EQ(camera["k3"].as<double>(), 0.0);
  EXPECT_EQ(camera["depth_scale"].as<double>(), 5000.0);
  const auto objects = nlohmann::json::parse(content(root_ / "seq" / "objects.json"));
  ASSERT_EQ(objects.size(), source.objects().size());
  EXPECT_EQ(objects.back()["class"], "person");
  EXPECT_EQ(objects.back()["moving"], true);
  EXPECT_EQ(objects.back()["id"], source.objects().back().id);
}

TEST_F(WriteSequence, WritesTheSameBytesWithAnyNumberOfThreads) {
  const SyntheticSource source(options_);
  SequenceWriteOptions one, three;
  one.threads = 1;
  three.threads = 3;
  write_sequence(source, root_ / "a", one);
  write_sequence(SyntheticSource(options_), root_ / "b", three);
  const auto a = contents(root_ / "a");
  EXPECT_EQ(a.size(), 3U * 4U + 7U);
  EXPECT_EQ(a, contents(root_ / "b"));
}

TEST_F(WriteSequence, KeepsAnExistingFolderUnlessToldToReplaceASequence) {
  const SyntheticSource source(options_);
  write_sequence(source, root_ / "seq", {});
  EXPECT_THROW(write_sequence(source, root_ / "seq", {}), UserError);
  SequenceWriteOptions replace;
  replace.overwrite = true;
  write_sequence(source, root_ / "seq", replace);

  fs::create_directories(root_ / "letters");
  std::ofstream(root_ / "letters" / "a.txt") << "dear";
  EXPECT_THROW(write_sequence(source, root_ / "letters", replace), UserError);
  EXPECT_EQ(content(root_ / "letters" / "a.txt"), "dear");
}

TEST_F(WriteSequence, LeavesNothingBehindWhenItFails) {
  const SyntheticSource source(options_);
  SequenceWriteOptions failing;
  failing.frame_done = [] { throw UserError("disk full"); };
  EXPECT_THROW(write_sequence(source, root_ / "seq", failing), UserError);
  EXPECT_TRUE(fs::is_empty(root_));
}

TEST_F(WriteSequence, NamesTheFolderThatCannotBeWritten) {
  std::ofstream(root_ / "file") << "in the way";
  try {
    write_sequence(SyntheticSource(options_), root_ / "file" / "seq", {});
    FAIL() << "must not succeed";
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find("seq"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace ipl_slam
