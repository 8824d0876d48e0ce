#include "dense/keyframe_folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include <ipl_slam/error.hpp>

#include "dataset/camera_config.hpp"
#include "dataset/temporary_folder.hpp"
#include "dataset/tum_dataset.hpp"
#include "dense/made_view.hpp"
#include "segmentation/mask_folder_segmenter.hpp"

namespace ipl_slam {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using testing::content_of;
using testing::equal;
using ::testing::HasSubstr;
using testing::made_view;
using testing::message_of;
using testing::TemporaryFolder;

const cv::Size kSize(64, 48);

class KeyframeFolder : public ::testing::Test {
 protected:
  KeyframeFolder() : folder_(temporary_ / "run/keyframes"), store_(kSize) {
    camera_.name = "my: \"cam\"";
    camera_.width = kSize.width;
    camera_.height = kSize.height;
    camera_.fx = 60.1;
    camera_.cx = 31.5;
    camera_.cy = 23.5;
    camera_.k1 = 0.1;
    // The later keyframe has the lower id, as after maps were joined.
    store_.add(KeyframeId{2}, made_view(kSize, 1));
    store_.add(KeyframeId{9}, made_view(kSize, 0));
    // In the order of the folder: by time.
    kept_ = {{KeyframeId{2},
              {.reference_time = 990.125,
               .reference_fingerprint = "0123456789abcdef",
               .T_c_reference = SE3::exp(twist_),
               .moved = {}}},
             {KeyframeId{9},
              {.reference_time = store_.timestamp(KeyframeId{9}),
               .reference_fingerprint = "",
               .T_c_reference = {},
               .moved = {first_instance()}}}};
    write_keyframe_folder(folder_, store_, kept_, camera_);
  }
  InstanceId first_instance() const { return store_.instances(KeyframeId{9}).front().id; }
  std::string refusal() const {
    return message_of<UserError>([&] {
      ViewStore store(kSize);
      (void)read_keyframe_folder(folder_, store);
    });
  }
  /// Changes keyframes.json.
  template <class Change>
  void change_index(const Change& change) const {
    nlohmann::ordered_json json = nlohmann::ordered_json::parse(content_of(folder_ / "keyframes.json"));
    change(json);
    temporary_.write("run/keyframes/keyframes.json", json.dump());
  }
  void overwrite(const std::string& name, const cv::Mat& image) const {
    ASSERT_TRUE(cv::imwrite((folder_ / name).string(), image));
  }

  TemporaryFolder temporary_;
  fs::path folder_;
  Camera camera_;
  ViewStore store_;
  const Vector6d twist_ = (Vector6d() << 0.1, -0.2, 0.3, 0.01, 0.02, -0.03).finished();
  KeptKeyframes kept_;
};

TEST_F(KeyframeFolder, GivesBackWhatWasWritten) {
  const Camera camera = load_camera((folder_ / "camera.yaml").string());
  EXPECT_EQ(camera.name, camera_.name);
  EXPECT_EQ(camera.fx, camera_.fx);
  EXPECT_FALSE(camera.distorted());
  ViewStore back({camera.width, camera.height});
  const KeptKeyframes kept = read_keyframe_folder(folder_, back);
  ASSERT_EQ(kept.size(), 2U);
  for (const auto& [id, old] : {std::pair(KeyframeId{0}, KeyframeId{9}), {KeyframeId{1}, KeyframeId{2}}}) {
    EXPECT_EQ(kept.at(id), kept_.at(old));
    EXPECT_EQ(back.timestamp(id), store_.timestamp(old));
    EXPECT_EQ(back.instances(id), store_.instances(old));
    EXPECT_EQ(back.color_jpeg(id), store_.color_jpeg(old));
    EXPECT_TRUE(equal(back.depth(id), store_.depth(old)));
    EXPECT_TRUE(equal(back.labels(id), store_.labels(old)));
  }
}

TEST_F(KeyframeFolder, HasTheSameBytesWhenWhatWasReadIsWrittenAgain) {
  ViewStore back(kSize);
  const KeptKeyframes kept = read_keyframe_folder(folder_, back);
  const fs::path again = temporary_ / "again";
  write_keyframe_folder(again, back, kept, camera_);
  int files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
    if (!entry.is_regular_file()) continue;
    ++files;
    EXPECT_EQ(content_of(again / fs::relative(entry.path(), folder_)), content_of(entry.path()))
        << entry.path();
  }
  EXPECT_EQ(files, 5 + 2 * 4);
}

TEST_F(KeyframeFolder, IsASequenceWithMasks) {
  const Camera camera = load_camera(*guess_camera(folder_));
  TumDataset dataset(folder_, camera);
  MaskFolderSegmenter masks({.folder = folder_.string()}, kSize);
  ASSERT_EQ(dataset.size(), 2U);
  for (const KeyframeId id : {KeyframeId{9}, KeyframeId{2}}) {
    const auto item = dataset.next();
    ASSERT_TRUE(item && item->frame) << (item ? item->detail : "");
    EXPECT_NEAR(item->frame->timestamp, store_.timestamp(id), 1e-6);
    EXPECT_TRUE(equal(item->frame->depth, store_.depth(id)));
    EXPECT_TRUE(equal(item->frame->color, store_.color(id)));
    const std::vector<Instance> instances = masks.segment(*item->frame);
    ASSERT_EQ(instances.size(), 2U);
    EXPECT_EQ(instances[0].class_name, "person");
    EXPECT_NEAR(instances[0].score, 0.87, 1e-6);
    EXPECT_TRUE(equal(instances[0].mask.to_image(), store_.labels(id) == 1));
    EXPECT_EQ(instances[1].class_name, "dining table");
  }
  EXPECT_TRUE(masks.remarks().empty());
}

TEST_F(KeyframeFolder, HoldsKeyframesOfOneTimeSideBySide) {
  ViewStore store(kSize), back(kSize);
  store.add(KeyframeId{1}, made_view(kSize, 3));
  DenseView other = made_view(kSize, 4);
  other.timestamp = store.timestamp(KeyframeId{1});
  store.add(KeyframeId{2}, other);
  write_keyframe_folder(folder_, store, {{KeyframeId{1}, {}}, {KeyframeId{2}, {}}}, camera_);
  EXPECT_EQ(read_keyframe_folder(folder_, back).size(), 2U);
  EXPECT_TRUE(equal(back.depth(KeyframeId{0}), store.depth(KeyframeId{1})));
  EXPECT_TRUE(equal(back.depth(KeyframeId{1}), store.depth(KeyframeId{2})));
}

TEST_F(KeyframeFolder, NumbersWhatASecondFolderHoldsBehindTheFirst) {
  ViewStore back(kSize);
  const KeptKeyframes first = read_keyframe_folder(folder_, back),
                      second = read_keyframe_folder(folder_, back);
  ASSERT_EQ(back.ids().size(), 4U);
  EXPECT_EQ(second.begin()->first, KeyframeId{2});
  for (const ViewInstance& a : back.instances(KeyframeId{0})) {
    for (const ViewInstance& b : back.instances(KeyframeId{2})) EXPECT_NE(a.id, b.id);
  }
  // Who moved has the new numbers, too.
  const InstanceId mover = back.instances(KeyframeId{2}).front().id;
  EXPECT_EQ(second.at(KeyframeId{2}).moved, std::set<InstanceId>{mover});
  EXPECT_EQ(first.at(KeyframeId{0}).moved, std::set<InstanceId>{first_instance()});
}

TEST_F(KeyframeFolder, TakesAwayWhatItWroteAndNothingElse) {
  temporary_.write("run/keyframes/notes.md", "mine");
  clear_keyframe_folder(folder_);
  ASSERT_TRUE(fs::exists(folder_ / "notes.md"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
  clear_keyframe_folder(folder_);  // not one of its own any more
  EXPECT_TRUE(fs::exists(folder_ / "notes.md"));
}

TEST_F(KeyframeFolder, SaysWhichFileIsMissingOrBroken) {
  const std::string name = "1000.250000";
  const std::string png = content_of(folder_ / ("depth/" + name + ".png"));
  temporary_.write("run/keyframes/depth/" + name + ".png", png.substr(0, png.size() / 2));
  EXPECT_THAT(refusal(), AllOf(HasSubstr("depth/" + name + ".png"), HasSubstr("too early")));
  overwrite("depth/" + name + ".png", cv::Mat(kSize, CV_8UC1, cv::Scalar(1)));
  EXPECT_THAT(refusal(), HasSubstr("16 bits"));
  overwrite("depth/" + name + ".png", cv::Mat(20, 30, CV_16UC1, cv::Scalar(1)));
  EXPECT_THAT(refusal(), AllOf(HasSubstr("30x20"), HasSubstr("64x48")));
  fs::remove(folder_ / ("depth/" + name + ".png"));
  EXPECT_THAT(refusal(), HasSubstr("no such file"));
  temporary_.write("run/keyframes/rgb/" + name + ".jpg", "no picture");
  EXPECT_THAT(refusal(), AllOf(HasSubstr("rgb/" + name + ".jpg"), HasSubstr("JPEG")));
}

TEST_F(KeyframeFolder, SaysWhatIsWrongWithItsIndex) {
  const auto with_instance_id = [&](auto value) {
    change_index([&](auto& json) { json["keyframes"][1]["instances"][0]["id"] = value; });
  };
  with_instance_id(-1);
  EXPECT_THAT(refusal(), HasSubstr("'id' is no whole number"));
  with_instance_id(4294967296);
  EXPECT_THAT(refusal(), HasSubstr("'id' is no whole number"));
  with_instance_id(5);
  change_index([](auto& json) { json["keyframes"][1]["instances"][0]["moved"] = 1; });
  EXPECT_THAT(refusal(), HasSubstr("'moved' is neither true nor false"));
  change_index([](auto& json) { json["keyframes"][1]["instances"][0]["moved"] = true; });
  change_index([](auto& json) { json["keyframes"][1]["instances"][0]["score"] = -1e30; });
  EXPECT_THAT(refusal(), HasSubstr("'score' is not between 0 and 1"));
  change_index([](auto& json) { json["keyframes"][1]["instances"][0]["score"] = 0.5; });
  change_index([](auto& json) { json["keyframes"][1]["T_c_reference"]["translation"] = {1, 2}; });
  EXPECT_THAT(refusal(), HasSubstr("'translation' has not 3 numbers"));
  change_index([](auto& json) {
    json["keyframes"][1]["T_c_reference"] = {{"translation", {1, 2, 3}}, {"rotation_xyzw", {0, 0, 0, 2}}};
  });
  EXPECT_THAT(refusal(), HasSubstr("'rotation_xyzw' is no unit quaternion"));
  change_index([](auto& json) { json["keyframes"][1]["reference_time"] = "now"; });
  EXPECT_THAT(refusal(), HasSubstr("'reference_time' is no number"));
  change_index([](auto& json) { json["keyframes"].erase(1); });
  change_index([](auto& json) { json["keyframes"][0].erase("timestamp"); });
  EXPECT_THAT(refusal(), HasSubstr("a 'timestamp' is missing"));
  change_index([](auto& json) { json["keyframes"][0]["timestamp"] = 1.0; });
  change_index([](auto& json) { json["keyframes"][0]["instances"].erase(1); });
  EXPECT_THAT(refusal(), HasSubstr("has the label 2"));
  change_index([](auto& json) { json["keyframes"][0]["color"] = "rgb/\n.jpg"; });
  EXPECT_THAT(refusal(), HasSubstr("'color' names no file"));
  change_index([](auto& json) { json["keyframes"] = 3; });
  EXPECT_THAT(refusal(), HasSubstr("'keyframes' is no list"));
  change_index([](auto& json) { json["keyframes"] = {{{"id", 1}}}; });
  EXPECT_THAT(refusal(), HasSubstr("'reference_time' is missing"));
  change_index([](auto& json) { json["version"] = 2; });
  EXPECT_THAT(refusal(), HasSubstr("version"));
  temporary_.write("run/keyframes/keyframes.json", "{\"version\": 1");
  EXPECT_THAT(refusal(), HasSubstr("no JSON"));
  temporary_.write("run/keyframes/keyframes.json", "[1]");
  EXPECT_THAT(refusal(), HasSubstr("a 'version' is missing"));
  fs::remove(folder_ / "keyframes.json");
  EXPECT_THAT(refusal(), HasSubstr("keyframes.json"));
}

TEST_F(KeyframeFolder, IsRefusedBeforeItIsWholeAndCanBeTakenAway) {
  fs::remove_all(folder_ / "depth");
  temporary_.write("run/keyframes/depth", "a file where a folder goes");
  EXPECT_THAT(message_of<UserError>([&] { write_keyframe_folder(folder_, store_, kept_, camera_); }),
              HasSubstr("depth"));
  fs::remove(folder_ / "depth");
  fs::create_directories(folder_ / "depth/1000.350000.png");
  EXPECT_THAT(message_of<UserError>([&] { write_keyframe_folder(folder_, store_, kept_, camera_); }),
              HasSubstr("1000.350000.png"));
  EXPECT_THAT(refusal(), HasSubstr("a 'keyframes' is missing"));
  fs::remove(folder_ / "depth/1000.350000.png");
  clear_keyframe_folder(folder_);
  EXPECT_FALSE(fs::exists(folder_));
}

}  // namespace
}  // namespace ipl_slam
