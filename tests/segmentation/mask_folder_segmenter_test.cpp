#include "segmentation/mask_folder_segmenter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include <ipl_slam/error.hpp>

#include "dataset/synthetic/write_sequence.hpp"
#include "dataset/temporary_folder.hpp"

namespace ipl_slam {
namespace {

using ::testing::AllOf;
using testing::content_of;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::message_of;
using testing::TemporaryFolder;

constexpr int kWidth = 40, kHeight = 30;

// Instance 1: 10x10 at the left; instance 2: 12x10 at the right.
cv::Mat two_labels(int type = CV_8UC1, int first = 1, int second = 2) {
  cv::Mat labels = cv::Mat::zeros(kHeight, kWidth, type);
  labels(cv::Rect(2, 3, 10, 10)) = first;
  labels(cv::Rect(20, 15, 12, 10)) = second;
  return labels;
}

void write_png(const TemporaryFolder& folder, const std::string& name, const cv::Mat& image) {
  ASSERT_TRUE(cv::imwrite((folder / name).string(), image));
}

MaskFolderSegmenter segmenter(const TemporaryFolder& folder, MaskFolderOptions options = {}) {
  options.folder = folder.path().string();
  return {options, {kWidth, kHeight}};
}

std::string refusal(const TemporaryFolder& folder) {
  return message_of<UserError>([&] { (void)segmenter(folder); });
}

RgbdFrame at(double timestamp) {
  RgbdFrame frame;
  frame.timestamp = timestamp;
  return frame;
}

TEST(MaskFolder, FindsMasksByTheTimeInTheirNames) {
  const TemporaryFolder folder;
  write_png(folder, "1305031102.175304.png", two_labels());
  write_png(folder, "1305031102.211214.png", cv::Mat::zeros(kHeight, kWidth, CV_8UC1));
  MaskFolderSegmenter masks = segmenter(folder);
  const std::vector<Instance> found = masks.segment(at(1305031102.176));
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].class_name, "unknown");
  EXPECT_EQ(found[0].score, 1.0F);
  EXPECT_EQ(found[0].box, cv::Rect(2, 3, 10, 10));
  EXPECT_EQ(found[0].mask.area(), 100);
  EXPECT_EQ(found[1].box, cv::Rect(20, 15, 12, 10));
  EXPECT_TRUE(masks.segment(at(1305031102.211214)).empty()) << "nobody there is no failure";
  EXPECT_THAT(masks.remarks(), IsEmpty());
}

TEST(MaskFolder, ReadsTheListOfARenderedSequence) {
  const TemporaryFolder folder;
  SyntheticOptions options;
  options.frames = 2;
  options.people = 1;
  options.width = 160;
  options.height = 120;
  options.trajectory = "static";
  const SyntheticSource source(options);
  write_sequence(source, folder / "room", {});
  MaskFolderOptions where;
  where.folder = (folder / "room").string();
  MaskFolderSegmenter masks(where, {160, 120});
  const cv::Mat truth = source.instance_mask(1);
  bool person_seen = false;
  for (const Instance& instance : masks.segment(at(source.timestamp(1)))) {
    int id = 0;
    for (const SyntheticObject& object : source.objects()) {
      if (instance.mask == BitMask::from_image(truth == object.id)) id = object.id;
    }
    ASSERT_NE(id, 0) << "a mask that is no object's";
    EXPECT_EQ(instance.class_name, source.objects()[static_cast<std::size_t>(id) - 1].class_name);
    person_seen |= instance.class_name == "person";
  }
  EXPECT_TRUE(person_seen);
}

TEST(MaskFolder, NamesInstancesByTheClassList) {
  const TemporaryFolder folder;
  write_png(folder, "1.png", two_labels(CV_16UC1, 7, 40000));
  folder.write("classes.txt", "# id class score\n7 person 0.5\n40000 dining table 0.75\n");
  const std::vector<Instance> found = segmenter(folder).segment(at(1.0));
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].class_name, "dining table") << "best score first";
  EXPECT_EQ(found[0].score, 0.75F);
  EXPECT_EQ(found[1].class_name, "person");
}

TEST(MaskFolder, ReadsNamesThatHoldNumbers) {
  const TemporaryFolder folder;
  write_png(folder, "1.png", two_labels());
  folder.write("classes.txt", "1 class 3\n2 class 3 0.9\n");
  std::vector<Instance> found = segmenter(folder).segment(at(1.0));
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].class_name, "class 3");
  EXPECT_EQ(found[0].score, 1.0F);
  EXPECT_EQ(found[1].class_name, "class 3");
  EXPECT_EQ(found[1].score, 0.9F);
  folder.write("classes.txt", "1 3 d printer 1.0\n2 42\n");
  found = segmenter(folder).segment(at(1.0));
  EXPECT_EQ(found[0].class_name, "3 d printer");
  EXPECT_EQ(found[1].class_name, "42");
}

TEST(MaskFolder, AFramesOwnListCounts) {
  const TemporaryFolder folder;
  write_png(folder, "1.0.png", two_labels());
  write_png(folder, "2.0.png", two_labels());
  folder.write("classes.txt", "1 person\n2 person\n");
  folder.write("2.0.txt", "1 chair 0.9\n");
  MaskFolderSegmenter masks = segmenter(folder);
  EXPECT_EQ(masks.segment(at(1.0))[1].class_name, "person");
  const std::vector<Instance> found = masks.segment(at(2.0));
  EXPECT_EQ(found[0].class_name, "unknown") << "the folder's list must not name the ids of this frame";
  EXPECT_EQ(found[1].class_name, "chair");
}

TEST(MaskFolder, CountsFramesWithoutMask) {
  const TemporaryFolder folder;
  write_png(folder, "1.png", two_labels());
  folder.write("masks.txt", "1.0 1.png\n2.0 2.png\n");
  MaskFolderSegmenter masks = segmenter(folder);
  EXPECT_TRUE(masks.segment(at(1.05)).empty()) << "50 ms away is another frame's mask";
  EXPECT_TRUE(masks.segment(at(2.0)).empty()) << "listed, but not there";
  EXPECT_EQ(masks.segment(at(1.01)).size(), 2u);
  EXPECT_THAT(masks.remarks(), ElementsAre(HasSubstr("2 of 3 frames have no mask in")));
}

TEST(MaskFolder, AsksWhetherItBelongsToTheSequenceIfNoFrameHasAMask) {
  const TemporaryFolder folder;
  write_png(folder, "1.png", two_labels());
  MaskFolderSegmenter masks = segmenter(folder);
  EXPECT_THAT(masks.remarks(), IsEmpty()) << "nothing was asked for yet";
  for (const double t : {100.0, 101.0, 102.0}) EXPECT_TRUE(masks.segment(at(t)).empty());
  EXPECT_THAT(masks.remarks(),
              ElementsAre(AllOf(HasSubstr("none of the 3 frames has a mask in '" + folder.path().string()),
                                HasSubstr("does it belong to this sequence?"))));
}

TEST(MaskFolder, CountsBrokenFilesAndSaysWhatIsWrong) {
  const TemporaryFolder folder;
  write_png(folder, "1.png", two_labels());
  write_png(folder, "3.png", cv::Mat::zeros(10, 10, CV_8UC1));
  write_png(folder, "4.png", cv::Mat::zeros(kHeight, kWidth, CV_8UC3));
  write_png(folder, "5.png", two_labels());
  const std::string whole = content_of(folder / "1.png");
  folder.write("2.png", whole.substr(0, whole.size() / 2));
  folder.write("5.txt", "one person\n");
  MaskFolderSegmenter masks = segmenter(folder);
  const auto remark_after = [&masks](double timestamp) {
    EXPECT_TRUE(masks.segment(at(timestamp)).empty());
    return masks.remarks().at(0);
  };
  EXPECT_THAT(remark_after(2), AllOf(HasSubstr("1 masks"), HasSubstr("2.png"), HasSubstr("too early")));
  EXPECT_THAT(remark_after(3), AllOf(HasSubstr("2 masks"), HasSubstr("3.png"), HasSubstr("10x10")));
  EXPECT_THAT(remark_after(4), AllOf(HasSubstr("3 masks"), HasSubstr("4.png"), HasSubstr("3 channels")));
  EXPECT_THAT(remark_after(5), AllOf(HasSubstr("4 masks could not be used"), HasSubstr("5.txt:1")));
  EXPECT_EQ(masks.segment(at(1)).size(), 2u) << "one broken file must not spoil the others";
}

TEST(MaskFolder, LeavesOutSpeckles) {
  const TemporaryFolder folder;
  write_png(folder, "1.png", two_labels());
  MaskFolderOptions options;
  options.min_area = 110;
  EXPECT_EQ(segmenter(folder, options).segment(at(1)).size(), 1u);
}

TEST(MaskFolder, RefusesAFolderThatCannotBeMeant) {
  EXPECT_THAT(message_of<UserError>([] {
                MaskFolderSegmenter({.folder = "/no/such"}, {kWidth, kHeight});
              }),
              HasSubstr("'/no/such' is no folder"));
  EXPECT_THAT(message_of<UserError>([] {
                MaskFolderSegmenter({}, {kWidth, kHeight});
              }),
              AllOf(HasSubstr("--masks FOLDER"), HasSubstr("segmentation.masks.folder")));
  const TemporaryFolder empty;
  EXPECT_THAT(refusal(empty), HasSubstr("holds no masks"));
  empty.write("1.png", "no picture");
  EXPECT_THAT(refusal(empty), AllOf(HasSubstr("none of the 1 masks"), HasSubstr("neither PNG nor JPEG")));
  const TemporaryFolder colours;
  write_png(colours, "1.png", cv::Mat::zeros(kHeight, kWidth, CV_8UC3));
  EXPECT_THAT(refusal(colours), HasSubstr("has 3 channels, a label image has one"));
  const TemporaryFolder small;
  write_png(small, "1.png", cv::Mat::zeros(10, 10, CV_8UC1));
  EXPECT_THAT(refusal(small), HasSubstr("is 10x10, the sequence 40x30"));
}

TEST(MaskFolder, FindsTheListBesideTheFolderOfImages) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "masks");
  write_png(folder, "masks/1.png", two_labels());
  folder.write("classes.txt", "1 person\n2 chair\n");
  const auto first_class = [&] {
    MaskFolderSegmenter masks({.folder = (folder / "masks").string()}, {kWidth, kHeight});
    return masks.segment(at(1.0)).at(0).class_name;
  };
  EXPECT_EQ(first_class(), "unknown") << "the list may be of something else";
  folder.write("masks.txt", "1.0 masks/1.png\n");
  EXPECT_EQ(first_class(), "person");
}

TEST(MaskFolder, RefusesAFolderThatCannotBeRead) {
  const TemporaryFolder folder;
  write_png(folder, "1.png", two_labels());
  std::filesystem::create_symlink("classes.txt", folder / "classes.txt");  // a link to itself
  EXPECT_THAT(refusal(folder), AllOf(HasSubstr("classes.txt' cannot be read"), HasSubstr("symbolic links")));
}

TEST(MaskFolder, RefusesABrokenClassList) {
  const TemporaryFolder folder;
  write_png(folder, "1.png", two_labels());
  for (const char* line : {"person 1", "0 person", "1 person 2.0", "1", "1 0.5", "1.5 person", "70000 person",
                           "1 person 0.9 10 20"}) {
    folder.write("classes.txt", line);
    EXPECT_THAT(refusal(folder), HasSubstr("classes.txt:1: cannot understand")) << line;
  }
  std::filesystem::remove(folder / "classes.txt");
  folder.write("objects.json", "[{\"id\": 1}]");
  EXPECT_THAT(refusal(folder), HasSubstr("objects.json"));
}

}  // namespace
}  // namespace ipl_slam
