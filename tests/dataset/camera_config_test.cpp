#include "dataset/camera_config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ipl_slam/error.hpp>

#include "dataset/temporary_folder.hpp"

namespace ipl_slam {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::message_of;
using testing::TemporaryFolder;

constexpr const char* kGood =
    "width: 320\nheight: 240\nfx: 262.5\nfy: 263\ncx: 160\ncy: 120\ndepth_scale: 1000\n";

class CameraFile : public ::testing::Test {
 protected:
  Camera load(const std::string& yaml) { return load_camera(folder_.write("my_camera.yaml", yaml).string()); }
  std::string failure(const std::string& yaml) {
    return message_of<UserError>([&] { (void)load(yaml); });
  }
  TemporaryFolder folder_;
};

TEST(CameraPreset, IsFoundByNameWhateverItsCase) {
  for (const std::string& name : camera_presets()) {
    const Camera camera = load_camera(name);
    EXPECT_EQ(camera.name, name);
    EXPECT_EQ(camera.width, 640);
    EXPECT_EQ(camera.height, 480);
    EXPECT_EQ(camera.depth_scale, 5000.0);
    EXPECT_NO_THROW(camera.check());
  }
  EXPECT_EQ(load_camera("TUM3").fx, 535.4);
  EXPECT_FALSE(load_camera("tum3").distorted());
  EXPECT_EQ(load_camera("tum1").k3, 1.163314);
  EXPECT_EQ(load_camera("bonn").cy, 237.756098);
}

TEST_F(CameraFile, IsReadBackAsItWasWritten) {
  Camera camera = load_camera("tum1");
  camera.name = "hall: \"left\" #2";
  const Camera back = load(camera_yaml(camera));
  EXPECT_EQ(back.name, camera.name);
  EXPECT_EQ(back.fx, camera.fx);
  EXPECT_EQ(back.k3, camera.k3);
  EXPECT_EQ(camera_yaml(back), camera_yaml(camera));
}

TEST(CameraPreset, ThatIsUnknownIsAnsweredWithTheNearest) {
  EXPECT_THAT(
      message_of<UserError>([] { (void)load_camera("bon"); }),
      AllOf(HasSubstr("unknown camera 'bon'; did you mean 'bonn'?"), HasSubstr("tum1, tum2, tum3, bonn")));
  EXPECT_THAT(message_of<UserError>([] { (void)load_camera("none/camera.yaml"); }),
              HasSubstr("no such file"));
}

TEST_F(CameraFile, GivesWhatItSaysAndNoDistortionUnlessItSaysSo) {
  const Camera plain = load(kGood);
  EXPECT_EQ(plain.name, "my_camera");
  EXPECT_EQ(plain.width, 320);
  EXPECT_EQ(plain.height, 240);
  EXPECT_EQ(plain.fx, 262.5);
  EXPECT_EQ(plain.fy, 263.0);
  EXPECT_EQ(plain.cx, 160.0);
  EXPECT_EQ(plain.cy, 120.0);
  EXPECT_EQ(plain.depth_scale, 1000.0);
  EXPECT_FALSE(plain.distorted());
  const Camera full =
      load(std::string(kGood) + "name: front\nk1: 1e-1\nk2: -0.2\np1: 0.3\np2: 0.4\nk3: 0.5\n");
  EXPECT_EQ(full.name, "front");
  EXPECT_EQ(full.k1, 0.1);
  EXPECT_EQ(full.k2, -0.2);
  EXPECT_EQ(full.p1, 0.3);
  EXPECT_EQ(full.p2, 0.4);
  EXPECT_EQ(full.k3, 0.5);
}

TEST_F(CameraFile, WithAnUnknownKeyIsAnsweredWithLineAndNearestKey) {
  EXPECT_THAT(failure(std::string(kGood) + "deph_scale: 5000\n"),
              HasSubstr("my_camera.yaml:8: unknown key 'deph_scale'; did you mean 'depth_scale'?"));
}

TEST_F(CameraFile, WithAMissingKeyIsRefusedAndNeverReadAsZero) {
  for (const char* key : {"width", "height", "fx", "fy", "cx", "cy", "depth_scale"}) {
    std::string yaml = kGood;
    const std::size_t at = yaml.find(std::string(key) + ":");
    yaml.erase(at, yaml.find('\n', at) + 1 - at);
    EXPECT_THAT(failure(yaml), HasSubstr(std::string("the key '") + key + "' is missing"));
  }
}

TEST_F(CameraFile, WithAWrongTypeNamesTheLine) {
  EXPECT_THAT(failure("fx: wide\n" + std::string(kGood)), HasSubstr(":1: 'fx' is a number, not 'wide'"));
  EXPECT_THAT(failure("fx: [1, 2]\n"), HasSubstr("'fx' is a number, not a list or map"));
  EXPECT_THAT(failure("fx:\n"), HasSubstr("'fx' is a number, not empty"));
  EXPECT_THAT(failure("fx: .nan\n"), HasSubstr("'fx' is a number"));
  EXPECT_THAT(failure("fx: 525px\n"), HasSubstr("'fx' is a number"));
  EXPECT_THAT(failure("width: 640.5\n"), HasSubstr("'width' is a whole number of pixels"));
}

TEST_F(CameraFile, WithAKeyGivenTwiceIsRefused) {
  EXPECT_THAT(failure(std::string(kGood) + "fx: 1\n"), HasSubstr(":8: the key 'fx' is given twice"));
}

TEST_F(CameraFile, WithValuesThatCannotBeIsRefusedByName) {
  std::string yaml = kGood;
  yaml.replace(yaml.find("262.5"), 5, "-3.0");
  EXPECT_THAT(failure(yaml), AllOf(HasSubstr("my_camera.yaml"), HasSubstr("fx")));
}

TEST_F(CameraFile, ThatIsNoMapOrNoYamlIsRefusedWithItsLine) {
  EXPECT_THAT(failure("just words\n"), HasSubstr("my_camera.yaml:1:"));
  EXPECT_THAT(failure(""), HasSubstr("key: value"));
  EXPECT_THAT(failure("fx: 1\nfy: [1\n"), AllOf(HasSubstr("my_camera.yaml:"), HasSubstr("no YAML")));
}

TEST(CameraGuess, FollowsTheNameOfTheSequence) {
  const TemporaryFolder folder;
  const auto guess = [&](const std::string& name) {
    std::filesystem::create_directories(folder / ("plain/" + name));
    return guess_camera(folder / ("plain/" + name));
  };
  EXPECT_EQ(guess("rgbd_dataset_freiburg1_desk"), "tum1");
  EXPECT_EQ(guess("rgbd_dataset_freiburg2_xyz"), "tum2");
  EXPECT_EQ(guess("rgbd_dataset_freiburg3_walking_xyz/"), "tum3");
  EXPECT_EQ(guess("fr1_desk_100"), "tum1");
  EXPECT_EQ(guess("my-FR3-run"), "tum3");
  EXPECT_EQ(guess("rgbd_bonn_balloon"), "bonn");
  EXPECT_EQ(guess("freiburg2_cut/part1"), "tum2") << "the folder above counts where the name says nothing";
  EXPECT_FALSE(guess("afr1"));
  EXPECT_FALSE(guess("fr12"));
  EXPECT_FALSE(guess("kitchen"));
}

TEST(CameraGuess, PrefersTheSequencesOwnFile) {
  const TemporaryFolder folder;
  const auto file = folder.write("fr1_desk/camera.yaml", kGood);
  EXPECT_EQ(guess_camera(folder / "fr1_desk"), file.string());
}

TEST_F(CameraFile, ThatHoldsLineEndsWithinAWordIsStillRefusedInOneLine) {
  const std::string message = failure("? \"two\\nlines \\e[31m\"\n: 1\n");
  EXPECT_THAT(message, HasSubstr("unknown key 'two?lines ?[31m'"));
}

}  // namespace
}  // namespace ipl_slam
