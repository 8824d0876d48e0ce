#include <cmath>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include <ipl_slam/slam.hpp>

#include "dataset/temporary_folder.hpp"
#include "dense/written_files.hpp"
#include "pipeline/pipeline.hpp"
#include "support/rendered_sequence.hpp"

namespace ipl_slam {
namespace {

using testing::render_all;
using testing::small_camera;
using testing::small_room;
using testing::TemporaryFolder;

CameraParameters small_parameters() {
  const Camera c = small_camera();
  return {c.width, c.height, c.fx, c.fy, c.cx, c.cy, c.k1, c.k2, c.p1, c.p2, c.k3, c.depth_scale};
}

SlamOptions options(const std::string& preset, const std::string& file = "",
                    const std::string& setting = "") {
  SlamOptions result;
  result.preset = preset;
  result.config_file = file;
  if (!setting.empty()) result.overrides.push_back(setting);
  return result;
}

ImageView view(const cv::Mat& image, PixelFormat format) {
  return {image.data, image.cols, image.rows, image.step[0], format};
}

ImageView color_view(const RgbdFrame& frame) {
  return view(frame.color, PixelFormat::kBgr8);
}

ImageView depth_view(const RgbdFrame& frame) {
  return view(frame.depth, PixelFormat::kDepth16);
}

std::string file_of(const Slam& slam) {
  const TemporaryFolder folder;
  slam.save_trajectory(folder / "trajectory.txt");
  return testing::content_of(folder / "trajectory.txt");
}

/// The trajectory file after all frames were given as they are.
std::string reference(const std::vector<RgbdFrame>& frames) {
  Slam slam(small_parameters());
  for (const RgbdFrame& f : frames) (void)slam.process(color_view(f), depth_view(f), f.timestamp);
  return file_of(slam);
}

TEST(SlamApi, GivesTheSamePosesAsThePipeline) {
  const std::vector<RgbdFrame> frames = render_all(small_room(15));
  Pipeline pipeline(small_camera(), {});
  Slam slam(small_parameters());
  for (const RgbdFrame& frame : frames) {
    const FrameResult expected = pipeline.process(frame);
    const TrackingResult result = slam.process(color_view(frame), depth_view(frame), frame.timestamp);
    EXPECT_EQ(result.state, expected.state);
    EXPECT_EQ(result.inliers, expected.inliers);
    EXPECT_EQ(result.lines, expected.lines);
    EXPECT_EQ(result.keyframe, expected.keyframe);
    EXPECT_EQ(result.T_wc.tx, expected.T_wc.translation().x());
    EXPECT_EQ(result.T_wc.qw, expected.T_wc.rotation().w());
  }
  const Trajectory expected = pipeline.trajectory();
  const std::vector<TimedPose> poses = slam.trajectory();
  ASSERT_EQ(poses.size(), expected.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    EXPECT_EQ(poses[i].timestamp, expected[i].timestamp);
    EXPECT_EQ(poses[i].T_wc.tz, expected[i].T_wc.translation().z());
  }
  EXPECT_EQ(slam.keyframes().size(), pipeline.keyframe_trajectory().size());
}

TEST(SlamApi, TakesRgbAndLeavesTheCallersPixelsAsTheyAre) {
  const std::vector<RgbdFrame> frames = render_all(small_room(8));
  Slam slam(small_parameters());
  for (const RgbdFrame& frame : frames) {
    cv::Mat rgb;
    cv::cvtColor(frame.color, rgb, cv::COLOR_BGR2RGB);
    const cv::Mat before = rgb.clone(), depth_before = frame.depth.clone();
    (void)slam.process(view(rgb, PixelFormat::kRgb8), depth_view(frame), frame.timestamp);
    EXPECT_EQ(std::memcmp(rgb.data, before.data, rgb.total() * rgb.elemSize()), 0);
    EXPECT_EQ(std::memcmp(frame.depth.data, depth_before.data, depth_before.total() * 2), 0);
  }
  EXPECT_EQ(file_of(slam), reference(frames));
}

TEST(SlamApi, ReadsRowsThatAreFurtherApartThanTheyAreLong) {
  const std::vector<RgbdFrame> frames = render_all(small_room(8));
  Slam slam(small_parameters());
  for (const RgbdFrame& frame : frames) {
    // The image is the left part of a wider one, whose rest must not be read.
    cv::Mat wide_color(frame.color.rows, frame.color.cols + 13, CV_8UC3, cv::Scalar::all(255));
    cv::Mat wide_depth(frame.depth.rows, frame.depth.cols + 7, CV_16UC1, cv::Scalar::all(9999));
    const cv::Rect all(cv::Point(0, 0), frame.color.size());
    frame.color.copyTo(wide_color(all));
    frame.depth.copyTo(wide_depth(all));
    (void)slam.process(view(wide_color(all), PixelFormat::kBgr8),
                       view(wide_depth(all), PixelFormat::kDepth16), frame.timestamp);
  }
  EXPECT_EQ(file_of(slam), reference(frames));
}

TEST(SlamApi, ARefusedFrameCountsAsNeverGiven) {
  const std::vector<RgbdFrame> frames = render_all(small_room(6));
  Slam slam(small_parameters());
  for (const RgbdFrame& f : frames) {
    const ImageView color = color_view(f), depth = depth_view(f);
    const auto refuses = [&](ImageView c, ImageView d, double time) {
      EXPECT_THROW((void)slam.process(c, d, time), std::invalid_argument);
    };
    ImageView wrong = color;
    wrong.data = nullptr;
    refuses(wrong, depth, f.timestamp);
    wrong = color;
    wrong.width = 0;
    refuses(wrong, depth, f.timestamp);
    wrong = color;
    wrong.width -= 1;
    refuses(wrong, depth, f.timestamp);
    wrong = color;
    wrong.stride_bytes = static_cast<std::size_t>(wrong.width) * 3 - 1;
    refuses(wrong, depth, f.timestamp);
    wrong = color;
    wrong.format = static_cast<PixelFormat>(99);
    refuses(wrong, depth, f.timestamp);
    refuses(depth, depth, f.timestamp);
    refuses(color, color, f.timestamp);
    refuses(color, ImageView{}, f.timestamp);
    (void)slam.process(color, depth, f.timestamp);
    refuses(color, depth, f.timestamp);
    refuses(color, depth, f.timestamp - 1.0);
  }
  EXPECT_EQ(file_of(slam), reference(frames));
}

TEST(SlamApi, NamesWhatIsWrongWithCameraAndSettings) {
  CameraParameters camera = small_parameters();
  camera.fx = 0.0;
  EXPECT_THROW(Slam{camera}, UserError);
  EXPECT_THROW((void)CameraParameters::preset("tum9"), UserError);
  EXPECT_THROW((void)CameraParameters::load("nowhere/camera.yaml"), UserError);
  EXPECT_THROW(Slam(small_parameters(), options("fastest")), UserError);
  EXPECT_THROW(Slam(small_parameters(), options("default", "nowhere/settings.yaml")), UserError);
  EXPECT_THROW(Slam(small_parameters(), options("default", "", "orb.featurs=1000")), UserError);
  EXPECT_THROW(Slam(small_parameters(), options("default", "", "orb.fast_min_threshold=200")), UserError);
  const Slam slam(small_parameters());
  EXPECT_THROW(slam.save_trajectory("/dev/null/trajectory.txt"), UserError);
}

SlamOptions with_map(const std::filesystem::path& file, bool localize_only = false) {
  SlamOptions result;
  result.map_file = file.string();
  result.localize_only = localize_only;
  return result;
}

// How far from a known pose the camera is put, m.
double distance(const Pose& pose, const Pose& other) {
  return std::hypot(pose.tx - other.tx, pose.ty - other.ty, pose.tz - other.tz);
}

TEST(SlamApi, GoesOnWithAMapThatWasSavedInItsWorld) {
  const TemporaryFolder folder;
  const std::vector<RgbdFrame> frames = render_all(small_room(30));
  Slam first(small_parameters());
  for (std::size_t i = 0; i < 20; ++i) {
    (void)first.process(color_view(frames[i]), depth_view(frames[i]), frames[i].timestamp);
  }
  first.save_map(folder / "room.map");
  const std::vector<TimedPose> before = first.trajectory();
  ASSERT_EQ(before.size(), 20U);
  for (const bool localize_only : {false, true}) {
    Slam second(small_parameters(), with_map(folder / "room.map", localize_only));
    EXPECT_TRUE(second.keyframes().empty()) << "what was loaded was not made";
    // Frame 10 again, and on from there: its world would begin at frame 10 if it had not recognised the
    // place.
    for (std::size_t i = 10; i < 30; ++i) {
      const TrackingResult result =
          second.process(color_view(frames[i]), depth_view(frames[i]), frames[i].timestamp);
      ASSERT_EQ(result.state, TrackingState::kTracking) << "frame " << i;
      EXPECT_FALSE(localize_only && result.keyframe);
      // The two runs see the same from the same places: centimetres remain.
      if (i < 20) {
        EXPECT_LT(distance(result.T_wc, before[i].T_wc), 0.02) << "frame " << i;
      }
    }
    EXPECT_GT(distance(before[10].T_wc, Pose{}), 0.05) << "or else the check above says nothing";
    EXPECT_EQ(second.trajectory().size(), 20U);
    EXPECT_EQ(second.keyframes().empty(), localize_only);
  }
}

TEST(SlamApi, LocalizingLeavesTheMapAsItIs) {
  const TemporaryFolder folder;
  const std::vector<RgbdFrame> frames = render_all(small_room(12));
  Slam first(small_parameters());
  for (const RgbdFrame& f : frames) (void)first.process(color_view(f), depth_view(f), f.timestamp);
  first.save_map(folder / "room.map");
  const std::string saved = testing::content_of(folder / "room.map");
  Slam second(small_parameters(), with_map(folder / "room.map", true));
  for (const RgbdFrame& f : frames) (void)second.process(color_view(f), depth_view(f), f.timestamp);
  // Nor does a camera that is lost for long start a part of its own.
  const RgbdFrame& last = frames.back();
  const cv::Mat black = cv::Mat::zeros(last.color.size(), last.color.type());
  for (const double later : {1.0, 5.0, 9.0}) {
    EXPECT_EQ(second.process(view(black, PixelFormat::kBgr8), depth_view(last), last.timestamp + later).state,
              TrackingState::kLost);
  }
  second.save_map(folder / "again.map");
  EXPECT_EQ(testing::content_of(folder / "again.map"), saved);
}

TEST(SlamApi, AMapCanBeSavedOntoTheOneThatWasLoaded) {
  const TemporaryFolder folder;
  const std::vector<RgbdFrame> frames = render_all(small_room(12));
  const auto file = folder / "room.map";
  for (const bool goes_on : {false, true}) {
    Slam slam(small_parameters(), goes_on ? with_map(file) : SlamOptions());
    for (const RgbdFrame& f : frames) (void)slam.process(color_view(f), depth_view(f), f.timestamp);
    slam.save_map(file);
  }
  EXPECT_NO_THROW(Slam(small_parameters(), with_map(file)));
}

TEST(SlamApi, SavingAMapWaitsForARealtimeMapper) {
  const TemporaryFolder folder;
  const std::vector<RgbdFrame> frames = render_all(small_room(12));
  Slam slam(small_parameters(), options("default", "", "schedule.mode=realtime"));
  for (const RgbdFrame& f : frames) (void)slam.process(color_view(f), depth_view(f), f.timestamp);
  slam.save_map(folder / "a.map");
  slam.save_map(folder / "b.map");
  EXPECT_EQ(testing::content_of(folder / "a.map"), testing::content_of(folder / "b.map"));
}

TEST(SlamApi, NamesWhatIsWrongWithAMap) {
  const TemporaryFolder folder;
  EXPECT_THROW(Slam(small_parameters(), with_map({}, true)), std::invalid_argument);
  EXPECT_THROW(Slam(small_parameters(), with_map(folder / "nowhere.map")), UserError);
  EXPECT_THROW(Slam(small_parameters(), with_map(folder.write("text.map", "dear diary"))), UserError);
  Slam slam(small_parameters());
  EXPECT_THROW(slam.save_map(folder / "early.map"), UserError) << "there is none yet";
  EXPECT_FALSE(std::filesystem::exists(folder / "early.map"));
  const RgbdFrame frame = render_all(small_room(1))[0];
  (void)slam.process(color_view(frame), depth_view(frame), frame.timestamp);
  EXPECT_THROW(slam.save_map("/dev/null/room.map"), UserError);
  slam.save_map(folder / "room.map");
  CameraParameters other = small_parameters();
  other.fx += 1.0;
  EXPECT_THROW(Slam(other, with_map(folder / "room.map")), UserError);
}

TEST(SlamApi, SavesACloudInTheFormatOfTheFilesName) {
  const TemporaryFolder folder;
  const std::vector<RgbdFrame> frames = render_all(small_room(12));
  for (const char* mode : {"schedule.mode=lockstep", "schedule.mode=realtime"}) {
    Slam slam(small_parameters(), options("default", "", mode));
    for (const RgbdFrame& f : frames) (void)slam.process(color_view(f), depth_view(f), f.timestamp);
    slam.save_cloud(folder / "cloud.ply");
    const testing::WrittenPly ply = testing::parse_written_ply(testing::content_of(folder / "cloud.ply"));
    const std::size_t points = ply.vertices.at("x").size();
    EXPECT_GT(points, 10000U) << "a room at a point per cm";

    slam.save_cloud(folder / "cloud.pcd");
    const testing::WrittenPcd pcd = testing::parse_written_pcd(testing::content_of(folder / "cloud.pcd"));
    EXPECT_EQ(pcd.head.at("POINTS"), std::to_string(points)) << mode;
    slam.save_cloud(folder / "again.ply");
    EXPECT_TRUE(testing::content_of(folder / "again.ply") == testing::content_of(folder / "cloud.ply"))
        << mode;
  }
}

TEST(SlamApi, ACloudGrowsAsFramesComeAfterItWasSaved) {
  const TemporaryFolder folder;
  const std::vector<RgbdFrame> frames = render_all(small_room(30, "xyz"));
  Slam slam(small_parameters()), at_once(small_parameters());
  std::size_t keyframes = 0;
  for (const RgbdFrame& f : frames) {
    (void)slam.process(color_view(f), depth_view(f), f.timestamp);
    (void)at_once.process(color_view(f), depth_view(f), f.timestamp);
    if (slam.keyframes().size() > keyframes) slam.save_cloud(folder / "cloud.ply");
    keyframes = slam.keyframes().size();
  }
  ASSERT_GT(keyframes, 2U);
  slam.save_cloud(folder / "cloud.ply");
  at_once.save_cloud(folder / "at_once.ply");
  EXPECT_TRUE(testing::content_of(folder / "cloud.ply") == testing::content_of(folder / "at_once.ply"))
      << "that it was looked at before must not show";
}

TEST(SlamApi, NamesWhatHindersACloud) {
  const TemporaryFolder folder;
  const RgbdFrame frame = render_all(small_room(1))[0];
  const auto file = folder / "cloud.ply";
  Slam slam(small_parameters());
  EXPECT_THROW(slam.save_cloud(file), UserError) << "there is no map yet";
  EXPECT_FALSE(std::filesystem::exists(file));
  (void)slam.process(color_view(frame), depth_view(frame), frame.timestamp);
  EXPECT_THROW(slam.save_cloud("/dev/null/cloud.ply"), UserError);
  EXPECT_THROW(slam.save_cloud(folder / "nowhere/cloud.pcd"), UserError);
  slam.save_map(folder / "room.map");

  Slam without(small_parameters(), options("default", "", "dense.enabled=false"));
  (void)without.process(color_view(frame), depth_view(frame), frame.timestamp);
  EXPECT_THROW(without.save_cloud(file), UserError);
  Slam localizing(small_parameters(), with_map(folder / "room.map", true));
  (void)localizing.process(color_view(frame), depth_view(frame), frame.timestamp);
  EXPECT_THROW(localizing.save_cloud(file), UserError);
  EXPECT_FALSE(std::filesystem::exists(file));
}

TEST(SlamApi, CanBeMoved) {
  const std::vector<RgbdFrame> frames = render_all(small_room(6));
  Slam first(small_parameters());
  for (std::size_t i = 0; i < 3; ++i) {
    (void)first.process(color_view(frames[i]), depth_view(frames[i]), frames[i].timestamp);
  }
  Slam second(std::move(first));
  for (std::size_t i = 3; i < 6; ++i) {
    (void)second.process(color_view(frames[i]), depth_view(frames[i]), frames[i].timestamp);
  }
  EXPECT_EQ(file_of(second), reference(frames));
}

TEST(SlamApi, WaitsForARealtimeMapperBeforeItGivesResults) {
  const std::vector<RgbdFrame> frames = render_all(small_room(15));
  Slam slam(small_parameters(), options("default", "", "schedule.mode=realtime"));
  for (const RgbdFrame& f : frames) (void)slam.process(color_view(f), depth_view(f), f.timestamp);
  const std::string once = file_of(slam);
  EXPECT_EQ(once, file_of(slam));
}

TEST(SlamApi, TellsWhoIsInThePictureAndWhere) {
  SyntheticOptions walk = small_room(16, "static");
  walk.people = 2;
  Slam slam(small_parameters(), options("default", "", "segmentation.segmenter=geometric"));
  std::size_t seen = 0;
  for (const RgbdFrame& frame : render_all(walk)) {
    const TrackingResult result = slam.process(color_view(frame), depth_view(frame), frame.timestamp);
    EXPECT_EQ(result.mask_age, 0);
    for (const SeenInstance& instance : result.instances) {
      ++seen;
      EXPECT_EQ(instance.class_name, "unknown");
      const std::vector<std::uint8_t> pixels = slam.instance_mask(instance.id);
      ASSERT_EQ(pixels.size(), 320U * 240U);
      const cv::Mat mask(240, 320, CV_8UC1, const_cast<std::uint8_t*>(pixels.data()));
      EXPECT_EQ(cv::boundingRect(mask), cv::Rect(instance.x, instance.y, instance.width, instance.height));
    }
  }
  EXPECT_GT(seen, 0U);
  EXPECT_TRUE(slam.instance_mask(1000000).empty());
}

}  // namespace
}  // namespace ipl_slam
