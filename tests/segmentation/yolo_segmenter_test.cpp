#include "segmentation/yolo_segmenter.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ipl_slam/error.hpp>

#include "dataset/image_file.hpp"
#include "dataset/temporary_folder.hpp"
#include "support/tiny_yolo.hpp"

namespace ipl_slam {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

const cv::Scalar kRed(0, 0, 255), kBlue(255, 0, 0), kGrey(90, 90, 90);

class YoloSegmenterTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!has_onnx_runtime()) GTEST_SKIP() << "built without ONNX Runtime";
  }

  YoloOptions with_model(const std::string& bytes) {
    YoloOptions options;
    options.model = folder_.write("model.onnx", bytes).string();
    return options;
  }

  /// The message of the UserError that loading a model of these bytes ends in.
  std::string error_of(const std::string& bytes) { return error_of(with_model(bytes)); }
  static std::string error_of(const YoloOptions& options) {
    try {
      const YoloSegmenter segmenter(options);
    } catch (const UserError& error) {
      return error.what();
    }
    return "no error";
  }

  testing::TemporaryFolder folder_;
};

RgbdFrame picture(cv::Size size, const cv::Rect& rectangle, const cv::Scalar& color) {
  RgbdFrame frame;
  frame.color = cv::Mat(size, CV_8UC3, kGrey);
  frame.color(rectangle) = color;
  return frame;
}

TEST_F(YoloSegmenterTest, FindsARectangleWithItsBoxClassAndMask) {
  YoloSegmenter segmenter(with_model(tiny_yolo()));
  const cv::Rect rectangle(16, 8, 24, 32);  // whole cells, so box and mask are known to the pixel
  const auto instances = segmenter.segment(picture({64, 64}, rectangle, kRed));
  ASSERT_EQ(instances.size(), 1U);  // of the twelve cells that propose the same box
  EXPECT_EQ(instances[0].class_name, "red thing");
  EXPECT_NEAR(instances[0].score, 0.9F, 1e-6);
  EXPECT_EQ(instances[0].box, rectangle);
  // Prototypes are -0.5 or below outside and 0.5 inside: interpolated, the zero lies less than half a
  // prototype pixel (2 pixels) inside the rectangle, and nothing outside is on.
  const BitMask& mask = instances[0].mask;
  EXPECT_EQ(mask.size(), cv::Size(64, 64));
  BitMask outside = mask;
  cv::Mat image(64, 64, CV_8UC1, cv::Scalar(0));
  image(rectangle) = 255;
  outside -= BitMask::from_image(image);
  EXPECT_TRUE(outside.none());
  const cv::Rect inner(rectangle.x + 2, rectangle.y + 2, rectangle.width - 4, rectangle.height - 4);
  for (int y = inner.y; y < inner.br().y; ++y) {
    for (int x = inner.x; x < inner.br().x; ++x) ASSERT_TRUE(mask.test(x, y)) << x << ' ' << y;
  }
}

TEST_F(YoloSegmenterTest, UndoesTheLetterboxOfAFixedInput) {
  YoloSegmenter segmenter(with_model(tiny_yolo()));
  // 128 x 96 goes to 64 x 48 below 8 rows of padding.
  EXPECT_EQ(segmenter.input_size({128, 96}), cv::Size(64, 64));
  const cv::Rect rectangle(32, 16, 48, 32);
  const auto instances = segmenter.segment(picture({128, 96}, rectangle, kBlue));
  ASSERT_EQ(instances.size(), 1U);
  EXPECT_EQ(instances[0].class_name, "blue thing");
  EXPECT_EQ(instances[0].box, rectangle);
  EXPECT_EQ(instances[0].mask.size(), cv::Size(128, 96));
  EXPECT_EQ(instances[0].mask.bounding_box() & rectangle, instances[0].mask.bounding_box());
  EXPECT_GT(instances[0].mask.area(), (48 - 8) * (32 - 8));
}

TEST_F(YoloSegmenterTest, ChoosesTheInputOfAnOpenModelByTheImage) {
  TinyYoloShape open;
  open.width = open.height = -1;
  YoloOptions options = with_model(tiny_yolo(open));
  options.image_side = 640;
  YoloSegmenter full(options);
  EXPECT_EQ(full.input_size({640, 480}), cv::Size(640, 480));
  EXPECT_EQ(full.input_size({320, 240}), cv::Size(640, 480));
  EXPECT_EQ(full.input_size({1280, 720}), cv::Size(640, 384));  // 360, rounded up
  EXPECT_EQ(full.input_size({480, 640}), cv::Size(480, 640));

  const RgbdFrame frame = picture({640, 480}, {160, 80, 240, 320}, kRed);
  const auto reference = full.segment(frame);
  ASSERT_EQ(reference.size(), 1U);
  EXPECT_EQ(reference[0].box, cv::Rect(160, 80, 240, 320));
  for (const int side : {320, 160, 200}) {
    options.image_side = side;
    const auto instances = YoloSegmenter(options).segment(frame);
    ASSERT_EQ(instances.size(), 1U) << side;
    // The edge of a mask may be off by half a pixel of the prototype, which is 16 of the image at most.
    EXPECT_GT(iou(instances[0].mask, reference[0].mask), 0.85) << side;
  }
}

TEST_F(YoloSegmenterTest, ShowsAFixedModelThePictureAsSmallAsAskedFor) {
  YoloOptions options = with_model(tiny_yolo());
  options.image_side = 64;
  const cv::Rect rectangle(16, 32, 64, 48);
  const auto whole = YoloSegmenter(options).segment(picture({128, 128}, rectangle, kRed));
  ASSERT_EQ(whole.size(), 1U);
  EXPECT_EQ(whole[0].box, rectangle);

  // A picture of 256 x 256 in 64 x 64 of an input of 128 x 128: four image pixels to one, 32 padded on every
  // side.
  TinyYoloShape larger;
  larger.width = larger.height = 128;
  options = with_model(tiny_yolo(larger));
  options.image_side = 64;
  const cv::Rect twice(32, 64, 128, 96);
  const auto padded = YoloSegmenter(options).segment(picture({256, 256}, twice, kRed));
  ASSERT_EQ(padded.size(), 1U);
  EXPECT_EQ(padded[0].box, twice);
  EXPECT_EQ(padded[0].mask.bounding_box() & twice, padded[0].mask.bounding_box());
}

TEST_F(YoloSegmenterTest, KeepsTheClassesAskedFor) {
  YoloOptions options = with_model(tiny_yolo());
  options.classes = "blue thing";
  YoloSegmenter segmenter(options);
  EXPECT_TRUE(segmenter.segment(picture({64, 64}, {16, 8, 24, 32}, kRed)).empty());
  EXPECT_EQ(segmenter.segment(picture({64, 64}, {16, 8, 24, 32}, kBlue)).size(), 1U);

  options.classes = "blue thin";
  EXPECT_THAT(error_of(options), HasSubstr("'blue thin'; did you mean 'blue thing'"));
}

TEST_F(YoloSegmenterTest, LeavesOutWhatScoresTooLittle) {
  YoloOptions options = with_model(tiny_yolo());
  options.min_score = 0.85;
  YoloSegmenter segmenter(options);
  EXPECT_TRUE(segmenter.segment(picture({64, 64}, {16, 8, 24, 32}, kBlue)).empty());  // 0.8
  EXPECT_EQ(segmenter.segment(picture({64, 64}, {16, 8, 24, 32}, kRed)).size(), 1U);  // 0.9
}

TEST_F(YoloSegmenterTest, SeesNothingInAnEmptyOrAGreyPicture) {
  YoloSegmenter segmenter(with_model(tiny_yolo()));
  EXPECT_TRUE(segmenter.segment(picture({64, 64}, {}, kRed)).empty());
  RgbdFrame grey;
  grey.color = cv::Mat(48, 64, CV_8UC1, cv::Scalar(200));
  EXPECT_TRUE(segmenter.segment(grey).empty());
}

TEST_F(YoloSegmenterTest, TellsHowLongItsPartsTook) {
  YoloSegmenter segmenter(with_model(tiny_yolo()));
  (void)segmenter.segment(picture({64, 64}, {16, 8, 24, 32}, kRed));
  EXPECT_GT(segmenter.times().preprocess, 0.0);
  EXPECT_GT(segmenter.times().inference, 0.0);
  EXPECT_GT(segmenter.times().postprocess, 0.0);
}

TEST_F(YoloSegmenterTest, SaysWhatIsWrongWithAModelOfAnotherKind) {
  TinyYoloShape detecting;
  detecting.prototypes = false;
  EXPECT_THAT(error_of(tiny_yolo(detecting)),
              AllOf(HasSubstr("model.onnx' is no segmenting YOLOv8 or YOLO11 export: expected one input"),
                    HasSubstr("found images float32[1,3,64,64] -> output0 float32[1,7,64]")));
  TinyYoloShape transposed;
  transposed.transposed = true;
  EXPECT_THAT(error_of(tiny_yolo(transposed)), HasSubstr("output0 float32[1,64,7], output1"));
  TinyYoloShape batched;
  batched.batch = 4;
  EXPECT_THAT(error_of(tiny_yolo(batched)), HasSubstr("found images float32[4,3,64,64]"));
}

TEST_F(YoloSegmenterTest, SaysWhatIsWrongWithAFileThatIsNoModel) {
  EXPECT_THAT(error_of(std::string()), HasSubstr("model.onnx' is empty"));
  EXPECT_THAT(error_of("no model"), HasSubstr("model.onnx' is no ONNX model"));
  EXPECT_THAT(error_of(tiny_yolo().substr(0, 1000)), HasSubstr("model.onnx' is no ONNX model"));
  YoloOptions options;
  EXPECT_THAT(error_of(options),
              AllOf(HasSubstr("needs a model"), HasSubstr("--model"), HasSubstr("IPL_SLAM_MODEL")));
  options.model = (folder_ / "absent.onnx").string();
  EXPECT_THAT(error_of(options), HasSubstr("absent.onnx"));
}

/// With the real network on real pictures.
class RealYoloTest : public YoloSegmenterTest {
 protected:
  void SetUp() override {
    YoloSegmenterTest::SetUp();
    if (IsSkipped()) return;
    const char* models = std::getenv("IPL_SLAM_MODELS");
    const char* data = std::getenv("IPL_SLAM_DATA");
    if (models == nullptr) GTEST_SKIP() << "needs IPL_SLAM_MODELS with yolov8n-seg.onnx in it";
    if (data == nullptr) GTEST_SKIP() << "needs IPL_SLAM_DATA with fr3_walking_halfsphere_49 in it";
    options_.model = (fs::path(models) / "yolov8n-seg.onnx").string();
    for (const auto& entry : fs::directory_iterator(fs::path(data) / "fr3_walking_halfsphere_49" / "rgb")) {
      pictures_.push_back(entry.path());
    }
    std::sort(pictures_.begin(), pictures_.end());
    ASSERT_GE(pictures_.size(), 45U);
  }

  static RgbdFrame load(const fs::path& file) {
    RgbdFrame frame;
    frame.color = load_image(file).image;
    return frame;
  }

  YoloOptions options_;
  std::vector<fs::path> pictures_;
};

TEST_F(RealYoloTest, FindsTwoPeople) {
  options_.classes = "person";
  YoloSegmenter segmenter(options_);
  for (std::size_t i = 0; i < 45; i += 15) {  // at the end one hides the other
    const auto people = segmenter.segment(load(pictures_[i]));
    EXPECT_GE(people.size(), 2U) << pictures_[i];
    for (const Instance& person : people) {
      EXPECT_EQ(person.box & person.mask.bounding_box(), person.mask.bounding_box());
    }
    // A tenth of the inference is the most that decoding may take; a busy machine disturbs both alike.
    EXPECT_LT(segmenter.times().postprocess, 0.1 * segmenter.times().inference);
  }
}

TEST_F(RealYoloTest, GivesTheSameInstancesWithOneAndTwoThreads) {
  const RgbdFrame frame = load(pictures_[0]);
  const auto one = YoloSegmenter(options_).segment(frame);
  options_.threads = 2;
  const auto two = YoloSegmenter(options_).segment(frame);
  ASSERT_EQ(one.size(), two.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].class_name, two[i].class_name);
    EXPECT_EQ(one[i].score, two[i].score);
    EXPECT_EQ(one[i].box, two[i].box);
    EXPECT_TRUE(one[i].mask == two[i].mask);
  }
}

}  // namespace
}  // namespace ipl_slam
