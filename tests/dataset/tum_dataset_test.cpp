#include "dataset/tum_dataset.hpp"

#include <cstdlib>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include <ipl_slam/error.hpp>

#include "dataset/camera_config.hpp"
#include "dataset/temporary_folder.hpp"

namespace ipl_slam {
namespace {

using ::testing::AllOf;
using testing::content_of;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::message_of;
using testing::TemporaryFolder;

constexpr int kWidth = 32, kHeight = 24;

Camera small_camera() {
  Camera camera;
  camera.name = "small";
  camera.width = kWidth;
  camera.height = kHeight;
  return camera;
}

/// A sequence in a temporary folder: frame i at 10 + i seconds, depth 5 ms later, depth value 1000 + i.
class TumSequence : public ::testing::Test {
 protected:
  void write_frames(int count) {
    std::string rgb = "# color images\n# timestamp filename\n", depth = rgb;
    for (int i = 0; i < count; ++i) {
      rgb += fmt::format("{}.000000 {}\n", 10 + i, color_name(i));
      depth += fmt::format("{}.005000 {}\n", 10 + i, depth_name(i));
      write_image(color_name(i), cv::Mat(kHeight, kWidth, CV_8UC3, cv::Scalar(i, 2, 3)));
      write_image(depth_name(i), cv::Mat(kHeight, kWidth, CV_16UC1, cv::Scalar(1000 + i)));
    }
    folder_.write("rgb.txt", rgb);
    folder_.write("depth.txt", depth);
  }

  void write_image(const std::string& name, const cv::Mat& image) {
    std::vector<unsigned char> bytes;
    cv::imencode(".png", image, bytes);
    folder_.write(name, {bytes.begin(), bytes.end()});
  }

  void truncate(const std::string& name, std::size_t dropped) {
    const std::string bytes = content_of(folder_ / name);
    folder_.write(name, bytes.substr(0, bytes.size() - dropped));
  }

  [[nodiscard]] std::vector<SourceItem> read_all(const TumDatasetOptions& options = {}) const {
    TumDataset dataset(folder_.path(), small_camera(), options);
    std::vector<SourceItem> items;
    while (std::optional<SourceItem> item = dataset.next()) items.push_back(std::move(*item));
    EXPECT_EQ(items.size(), dataset.size());
    EXPECT_FALSE(dataset.next());
    return items;
  }

  /// Reads three frames of which the middle one is broken, and gives what is said about it.
  [[nodiscard]] SourceItem skipped_middle() const {
    const std::vector<SourceItem> items = read_all();
    if (items.size() != 3 || !items[0].frame || items[1].frame || !items[2].frame) {
      ADD_FAILURE() << "frame 1, and only that, should be skipped";
      return {};
    }
    EXPECT_EQ(items[1].timestamp, 11.0);
    EXPECT_EQ(items[2].frame->index, 2u) << "skipped frames count";
    return items[1];
  }

  [[nodiscard]] std::string failure(const TumDatasetOptions& options = {}) const {
    return message_of<UserError>([&] { TumDataset(folder_.path(), small_camera(), options); });
  }

  static std::string color_name(int i) { return fmt::format("rgb/{}.png", i); }
  static std::string depth_name(int i) { return fmt::format("depth/{}.png", i); }

  TemporaryFolder folder_;
};

std::vector<std::string> reasons(const std::vector<SourceItem>& items) {
  std::vector<std::string> result;
  for (const SourceItem& item : items) result.push_back(item.frame ? "frame" : item.skip_reason);
  return result;
}

TEST_F(TumSequence, GivesEveryPairInOrderWithItsPixels) {
  write_frames(3);
  const std::vector<SourceItem> items = read_all();
  ASSERT_EQ(items.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    ASSERT_TRUE(items[i].frame) << items[i].detail;
    const RgbdFrame& frame = *items[i].frame;
    EXPECT_EQ(frame.index, i);
    EXPECT_EQ(frame.timestamp, 10.0 + static_cast<double>(i)) << "the colour image's time is the frame's";
    EXPECT_EQ(frame.color.type(), CV_8UC3);
    EXPECT_EQ(frame.color.at<cv::Vec3b>(0, 0), cv::Vec3b(static_cast<unsigned char>(i), 2, 3));
    EXPECT_EQ(frame.depth.type(), CV_16UC1);
    EXPECT_EQ(frame.depth.at<std::uint16_t>(0, 0), 1000 + i);
  }
}

TEST_F(TumSequence, ReadsJpegColorWhateverItsName) {
  write_frames(1);
  std::vector<unsigned char> bytes;
  cv::imencode(".jpg", cv::Mat(kHeight, kWidth, CV_8UC3, cv::Scalar::all(90)), bytes);
  folder_.write(color_name(0), {bytes.begin(), bytes.end()});
  EXPECT_THAT(reasons(read_all()), ElementsAre("frame"));
}

TEST_F(TumSequence, TurnsColorWithTransparencyIntoPlainColor) {
  write_frames(1);
  write_image(color_name(0), cv::Mat(kHeight, kWidth, CV_8UC4, cv::Scalar(1, 2, 3, 4)));
  const std::vector<SourceItem> items = read_all();
  ASSERT_TRUE(items.at(0).frame);
  EXPECT_EQ(items[0].frame->color.at<cv::Vec3b>(0, 0), cv::Vec3b(1, 2, 3));
}

TEST_F(TumSequence, UnderstandsWindowsLineEndsAndBlanksInFileNames) {
  write_frames(1);
  folder_.write("rgb.txt", "# timestamp filename\r\n10.0 rgb/my image.png\r\n");
  std::filesystem::rename(folder_ / color_name(0), folder_ / "rgb/my image.png");
  EXPECT_THAT(reasons(read_all()), ElementsAre("frame"));
}

TEST_F(TumSequence, LeavesOutAndCountsImagesWithoutPartner) {
  write_frames(3);
  folder_.write("depth.txt", "10.005 depth/0.png\n11.5 depth/1.png\n12.005 depth/2.png\n13 depth/3.png\n");
  TumDataset dataset(folder_.path(), small_camera());
  EXPECT_EQ(dataset.size(), 2u);
  EXPECT_EQ(dataset.unpaired_color(), 1u);
  EXPECT_EQ(dataset.unpaired_depth(), 2u);
}

TEST_F(TumSequence, PairsWithinTheWindowAskedFor) {
  write_frames(2);
  TumDatasetOptions narrow;
  narrow.max_difference = 0.004;
  EXPECT_THAT(failure(narrow), HasSubstr("within 0.004 s"));
}

TEST_F(TumSequence, UsesAnAssociationsFileWhereTheListsAreMissing) {
  write_frames(2);
  folder_.write("associations.txt",
                "10.0 rgb/0.png 10.1 depth/0.png\n11.0 rgb/my 1.png 11.1 depth/my 1.png\n");
  for (const char* kind : {"rgb/", "depth/"}) {
    std::filesystem::rename(folder_ / (std::string(kind) + "1.png"),
                            folder_ / (std::string(kind) + "my 1.png"));
  }
  std::filesystem::remove(folder_ / "rgb.txt");
  EXPECT_THAT(reasons(read_all()), ElementsAre("frame", "frame"))
      << "whatever the window: the pairs are given";
}

TEST_F(TumSequence, UsesAnAssociationsFileThatIsAskedFor) {
  write_frames(3);
  folder_.write("some.txt", "12.0 rgb/2.png 12.0 depth/2.png\n");
  TumDatasetOptions options;
  options.associations = "some.txt";
  const std::vector<SourceItem> items = read_all(options);
  ASSERT_EQ(items.size(), 1u);
  EXPECT_EQ(items[0].timestamp, 12.0);
  options.associations = "none.txt";
  EXPECT_THAT(failure(options), HasSubstr("none.txt': no such file"));
}

TEST_F(TumSequence, NamesTheGroundTruthWhereThereIsOne) {
  write_frames(1);
  EXPECT_FALSE(TumDataset(folder_.path(), small_camera()).ground_truth());
  folder_.write("groundtruth.txt", "10 0 0 0 0 0 0 1\n");
  EXPECT_EQ(TumDataset(folder_.path(), small_camera()).ground_truth(), folder_ / "groundtruth.txt");
}

TEST_F(TumSequence, RefusesAMissingFolder) {
  const std::string message = message_of<UserError>([&] { TumDataset(folder_ / "none", small_camera()); });
  EXPECT_THAT(message, AllOf(HasSubstr("no such folder"), HasSubstr("none")));
}

TEST_F(TumSequence, RefusesAFileInPlaceOfTheFolder) {
  const auto file = folder_.write("file", "");
  EXPECT_THAT(message_of<UserError>([&] { TumDataset(file, small_camera()); }), HasSubstr("is a file"));
}

TEST_F(TumSequence, RefusesAFolderWithoutLists) {
  EXPECT_THAT(failure(), HasSubstr("holds no rgb.txt"));
  folder_.write("rgb.txt", "1 a.png\n");
  EXPECT_THAT(failure(), HasSubstr("holds no depth.txt"));
}

TEST_F(TumSequence, RefusesEmptyLists) {
  write_frames(1);
  folder_.write("depth.txt", "# timestamp filename\n\n");
  EXPECT_THAT(failure(), HasSubstr("depth.txt' lists no image"));
}

TEST_F(TumSequence, NamesFileAndLineThatCannotBeUnderstood) {
  write_frames(1);
  for (const char* line : {"rgb/1.png 11.0", "11.0", "nan rgb/1.png", "11.0x rgb/1.png"}) {
    folder_.write("rgb.txt", std::string("# head\n10.0 rgb/0.png\n") + line + "\n");
    EXPECT_THAT(failure(), AllOf(HasSubstr("rgb.txt:3: cannot understand"), HasSubstr(line)));
  }
}

TEST_F(TumSequence, NamesAnAssociationThatCannotBeUnderstood) {
  for (const char* line :
       {"10.0 rgb/0.png depth/0.png", "10.0 rgb/0.png 10.1", "10.0 a.png 10.1 b 10.2 c.png"}) {
    folder_.write("associations.txt", std::string(line) + "\n");
    EXPECT_THAT(failure(), HasSubstr("associations.txt:1: cannot understand")) << line;
  }
}

TEST_F(TumSequence, TellsBothRangesOfTimeWhenTheyDoNotOverlap) {
  write_frames(2);
  folder_.write("depth.txt", "500.0 depth/0.png\n501.5 depth/1.png\n");
  EXPECT_THAT(failure(), AllOf(HasSubstr("10.000000 to 11.000000 s"), HasSubstr("500.000000 to 501.500000 s"),
                               HasSubstr("489.000000 s apart")));
}

TEST_F(TumSequence, SkipsMissingImages) {
  write_frames(3);
  std::filesystem::remove(folder_ / color_name(1));
  EXPECT_EQ(skipped_middle().skip_reason, "missing color image");
  write_frames(3);
  std::filesystem::remove(folder_ / depth_name(1));
  EXPECT_EQ(skipped_middle().skip_reason, "missing depth image");
}

TEST_F(TumSequence, SkipsTruncatedImages) {
  write_frames(3);
  truncate(color_name(1), 1);
  const SourceItem color = skipped_middle();
  EXPECT_EQ(color.skip_reason, "truncated color image");
  EXPECT_THAT(color.detail, HasSubstr("rgb/1.png"));
  write_frames(3);
  truncate(depth_name(1), 30);
  EXPECT_EQ(skipped_middle().skip_reason, "truncated depth image");
}

TEST_F(TumSequence, SkipsWhatIsNoImage) {
  write_frames(3);
  folder_.write(depth_name(1), "no image");
  EXPECT_EQ(skipped_middle().skip_reason, "unreadable depth image");
}

TEST_F(TumSequence, SkipsDepthThatIsNot16BitsDeep) {
  write_frames(3);
  for (const int type : {CV_8UC1, CV_8UC3, CV_16UC3}) {
    write_image(depth_name(1), cv::Mat(kHeight, kWidth, type, cv::Scalar::all(7)));
    EXPECT_EQ(skipped_middle().skip_reason, "depth image not 16-bit");
  }
}

TEST_F(TumSequence, SkipsColorThatIsNot8BitsDeep) {
  write_frames(3);
  write_image(color_name(1), cv::Mat(kHeight, kWidth, CV_16UC3, cv::Scalar::all(7)));
  EXPECT_EQ(skipped_middle().skip_reason, "color image not 8-bit");
}

TEST_F(TumSequence, SkipsAFrameWhoseSizeChanges) {
  write_frames(3);
  write_image(color_name(1), cv::Mat(kHeight * 2, kWidth * 2, CV_8UC3, cv::Scalar::all(7)));
  write_image(depth_name(1), cv::Mat(kHeight * 2, kWidth * 2, CV_16UC1, cv::Scalar::all(7)));
  const SourceItem item = skipped_middle();
  EXPECT_EQ(item.skip_reason, "wrong image size");
  EXPECT_THAT(item.detail, AllOf(HasSubstr("64x48"), HasSubstr("'small' gives 32x24")));
}

TEST_F(TumSequence, SkipsDepthOfAnotherSizeThanColor) {
  write_frames(3);
  write_image(depth_name(1), cv::Mat(kHeight / 2, kWidth / 2, CV_16UC1, cv::Scalar::all(7)));
  EXPECT_EQ(skipped_middle().skip_reason, "color and depth differ in size");
}

TEST_F(TumSequence, SkipsDuplicateAndBackwardTimestampsWhereTheyStand) {
  write_frames(3);
  folder_.write("rgb.txt", "10 rgb/0.png\n11 rgb/1.png\n11 rgb/1.png\n10.5 rgb/0.png\n12 rgb/2.png\n");
  const std::vector<SourceItem> items = read_all();
  EXPECT_THAT(reasons(items),
              ElementsAre("frame", "frame", "duplicate timestamp", "backward timestamp", "frame"));
  EXPECT_THAT(items[3].detail, AllOf(HasSubstr("rgb.txt:4"), HasSubstr("10.500000 comes after 11.000000")));
}

TEST_F(TumSequence, SkipsDuplicateAndBackwardTimestampsOfDepth) {
  write_frames(3);
  folder_.write("depth.txt",
                "10 depth/0.png\n10 depth/0.png\n11 depth/1.png\n3 depth/0.png\n12 depth/2.png\n");
  EXPECT_THAT(reasons(read_all()),
              ElementsAre("frame", "duplicate timestamp", "frame", "backward timestamp", "frame"));
}

TEST_F(TumSequence, SkipsBackwardTimestampsOfAnAssociationsFile) {
  write_frames(2);
  folder_.write("pairs.txt", "11 rgb/1.png 11 depth/1.png\n10 rgb/0.png 10 depth/0.png\n");
  TumDatasetOptions options;
  options.associations = "pairs.txt";
  EXPECT_THAT(reasons(read_all(options)), ElementsAre("frame", "backward timestamp"));
}

TEST_F(TumSequence, IsReportedAsSkippedThroughoutWhenEveryImageIsBroken) {
  write_frames(2);
  for (int i = 0; i < 2; ++i) folder_.write(color_name(i), "");
  EXPECT_THAT(reasons(read_all()), ElementsAre("truncated color image", "truncated color image"));
}

TEST(TumRecording, IsReadWholeAndPairedAsItsOwnAssociationsSay) {
  const char* data = std::getenv("IPL_SLAM_DATA");
  const std::filesystem::path folder = std::filesystem::path(data == nullptr ? "" : data) / "fr1_desk_100";
  if (data == nullptr || !std::filesystem::exists(folder))
    GTEST_SKIP() << "needs IPL_SLAM_DATA with fr1_desk_100 in it";
  TumDatasetOptions given;
  given.associations = "associations.txt";
  TumDataset from_lists(folder, load_camera("tum1")), from_pairs(folder, load_camera("tum1"), given);
  ASSERT_EQ(from_lists.size(), 95u);
  ASSERT_EQ(from_pairs.size(), 95u);
  while (std::optional<SourceItem> a = from_lists.next()) {
    const std::optional<SourceItem> b = from_pairs.next();
    ASSERT_TRUE(a->frame) << a->detail;
    ASSERT_TRUE(b && b->frame);
    EXPECT_EQ(a->timestamp, b->timestamp);
    EXPECT_EQ(cv::norm(a->frame->depth, b->frame->depth, cv::NORM_INF), 0.0);
  }
}

}  // namespace
}  // namespace ipl_slam
