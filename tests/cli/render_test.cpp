// `ipl_slam render`: pictures of a cloud.
#include <algorithm>
#include <filesystem>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "dataset/trajectory.hpp"
#include "dense/cloud_file.hpp"
#include "program.hpp"
#include "refused.hpp"

namespace ipl_slam {
namespace {

using testing::content_of;
using testing::expect_refused;
using testing::Finished;
using ::testing::HasSubstr;
using testing::ipl_slam_program;
using testing::TemporaryFolder;

// A floor of 2 x 2 m with a red wall, as a run leaves it: the world is that of a camera 1 m up.
struct RunOnDisk {
  RunOnDisk() {
    for (int i = 0; i < 100; ++i) {
      for (int k = 0; k < 100; ++k) {
        const float a = 0.02F * static_cast<float>(i), b = 0.02F * static_cast<float>(k);
        CloudPoint floor, wall;
        floor.position = {a - 1.0F, 1.0F, b + 1.0F};
        floor.normal = -Eigen::Vector3f::UnitY();
        floor.color = {0, 200, 0};
        wall.position = {a - 1.0F, 1.0F - b, 3.0F};
        wall.normal = -Eigen::Vector3f::UnitZ();
        wall.color = {200, 0, 0};
        wall.label = 3;
        wall.confidence = 0.5F;
        cloud.points.insert(cloud.points.end(), {floor, wall});
      }
    }
    cloud.classes = {{3, "car", {0, 0, 255}}};
    folder.write("run/cloud.ply", cloud_ply(cloud));
    folder.write("cloud.pcd", cloud_pcd(cloud));
    Trajectory trajectory;
    for (int i = 0; i < 5; ++i) {
      trajectory.push_back({i + 1.0, SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.1 * i, 0, 0))});
    }
    write_trajectory(folder / "run/trajectory.txt", trajectory);
  }

  [[nodiscard]] Finished render(std::vector<std::string> words) const {
    words.insert(words.begin(), {"render", run, "-o", picture, "--size", "160x120"});
    return ipl_slam_program(words);
  }
  // The picture that was made, or an empty one.
  [[nodiscard]] cv::Mat made() const { return cv::imread(picture); }

  const TemporaryFolder folder;
  const std::string run = (folder / "run").string(), picture = (folder / "a.png").string();
  SemanticCloud cloud;
};

bool has_color(const cv::Mat& picture, const std::function<bool(const cv::Vec3b&)>& is_it) {
  return std::any_of(picture.begin<cv::Vec3b>(), picture.end<cv::Vec3b>(), is_it);
}
bool is_red(const cv::Vec3b& c) {
  return c[2] > 100 && c[1] < 20 && c[0] < 20;
}
bool is_blue(const cv::Vec3b& c) {
  return c[0] > 100 && c[1] < 20 && c[2] < 20;
}

TEST(CliRender, DrawsARunFromEverySide) {
  const RunOnDisk run;
  for (const char* view : {"orbit", "top", "trajectory"}) {
    for (const char* color : {"image", "labels", "normals", "height", "confidence"}) {
      std::filesystem::remove(run.picture);
      const Finished finished = run.render({"--view", view, "--color", color});
      EXPECT_EQ(finished.code, 0) << finished.err;
      EXPECT_THAT(finished.err, ::testing::Not(HasSubstr("warning")));
      EXPECT_EQ(run.made().size(), cv::Size(160, 120)) << view << " " << color;
    }
  }
}

TEST(CliRender, ShowsWhatItIsAskedFor) {
  const RunOnDisk run;
  ASSERT_EQ(run.render({"--azimuth", "180", "--trajectory", "off"}).code, 0);
  EXPECT_TRUE(has_color(run.made(), is_red)) << "the wall, from where the camera was";
  ASSERT_EQ(run.render({"--azimuth", "0", "--trajectory", "off"}).code, 0);
  EXPECT_FALSE(has_color(run.made(), is_red)) << "its back is not drawn";
  ASSERT_EQ(run.render({"--azimuth", "0", "--trajectory", "off", "--all-faces"}).code, 0);
  EXPECT_TRUE(has_color(run.made(), is_red));
  ASSERT_EQ(run.render({"--azimuth", "180", "--color", "labels"}).code, 0);
  EXPECT_TRUE(has_color(run.made(), is_blue));
  ASSERT_EQ(run.render({"--background", "dark"}).code, 0);
  EXPECT_LT(run.made().at<cv::Vec3b>(119, 0)[0], 50);
}

TEST(CliRender, DrawsTheSamePictureTwice) {
  const RunOnDisk run;
  ASSERT_EQ(run.render({}).code, 0);
  const std::string first = content_of(run.picture);
  ASSERT_EQ(run.render({}).code, 0);
  EXPECT_EQ(content_of(run.picture), first);
}

TEST(CliRender, GoesOnceAround) {
  const RunOnDisk run;
  const std::string folder = (run.folder / "around").string();
  const Finished finished =
      ipl_slam_program({"render", run.run, "-o", folder, "--size", "64x48", "--frames", "3"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  for (const char* name : {"0000.png", "0001.png", "0002.png"}) {
    EXPECT_EQ(cv::imread(folder + "/" + name).size(), cv::Size(64, 48));
  }
  EXPECT_NE(content_of(folder + "/0000.png"), content_of(folder + "/0001.png"));
}

TEST(CliRender, TakesACloudAlone) {
  const RunOnDisk run;
  const std::string pcd = (run.folder / "cloud.pcd").string();
  EXPECT_EQ(ipl_slam_program({"render", pcd, "-o", run.picture}).code, 0);
  EXPECT_EQ(run.made().size(), cv::Size(1280, 720));
  EXPECT_EQ(ipl_slam_program({"render", pcd, "-o", run.picture, "--view", "trajectory", "--at", "4",
                              "--trajectory", run.run + "/trajectory.txt"})
                .code,
            0);
}

TEST(CliRender, RefusesWhatItCannotDraw) {
  const RunOnDisk run;
  expect_refused(run.render({"--view", "sideways"}), {"sideways", "orbit"});
  expect_refused(run.render({"--view", "trajectory", "--at", "5"}), {"--at 5", "0 to 4"});
  expect_refused(run.render({"--view", "trajectory", "--trajectory", "off"}), {"--trajectory FILE"});
  expect_refused(run.render({"--view", "top", "--frames", "5"}), {"--frames", "orbit"});
  expect_refused(run.render({"--trajectory", "nowhere.txt"}), {"nowhere.txt"});
  expect_refused(run.render({"--colour", "image"}), {"--colour", "--color"});
  EXPECT_FALSE(std::filesystem::exists(run.picture)) << "nothing is drawn then";

  for (const char* size : {"big", "99999x1", "160x"}) {
    expect_refused(ipl_slam_program({"render", run.run, "-o", run.picture, "--size", size}),
                   {size, "1280x720"});
  }
  const auto render = [&](const std::string& input, const std::string& output) {
    return ipl_slam_program({"render", input, "-o", output});
  };
  expect_refused(render((run.folder / "nowhere").string(), run.picture), {"nowhere"});
  expect_refused(render(run.folder.path().string(), run.picture), {"cloud.ply"});
  expect_refused(render(run.folder.write("text.ply", "dear diary").string(), run.picture),
                 {"text.ply", "no cloud"});
  expect_refused(render(run.folder.write("none.ply", cloud_ply({})).string(), run.picture),
                 {"none.ply", "no points"});
  expect_refused(render(run.run, (run.folder / "a.gif.txt").string()), {"a.gif.txt"});
  expect_refused(render(run.run, (run.folder / "deep/a.png").string()), {"deep"});
  expect_refused(ipl_slam_program({"render", run.run}), {"--output"});
}

}  // namespace
}  // namespace ipl_slam
