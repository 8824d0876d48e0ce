#include "dense/dense_map.hpp"

#include <algorithm>
#include <memory>

#include <gtest/gtest.h>

#include "dense/cloud_file.hpp"
#include "support/rendered_sequence.hpp"

namespace ipl_slam {
namespace {

using testing::small_room;

constexpr int kViews = 6;

// A room with somebody in it, seen from a few places.
class Room {
 public:
  Room() {
    SyntheticOptions options = small_room(kViews * 10, "xyz");
    options.people = 1;
    options.story = "stand";
    options.clothes = "plain";
    const SyntheticSource source(options, 2);
    camera = source.camera();
    for (int i = 0; i < kViews; ++i) {
      frames.push_back(source.render(static_cast<std::size_t>(10 * i)));
      masks.push_back(frames.back().mask);
    }
    for (const SyntheticObject& object : source.objects()) {
      if (object.class_name == "person") person = object.id;
    }
  }

  [[nodiscard]] std::vector<TrackedInstance> people(std::size_t i) const {
    TrackedInstance tracked;
    tracked.id = InstanceId{7};
    tracked.instance.class_name = "unknown";
    tracked.instance.score = 0.9F;
    tracked.instance.mask = BitMask::from_image(masks[i] == person);
    tracked.instance.box = tracked.instance.mask.bounding_box();
    return {tracked};
  }
  [[nodiscard]] std::unique_ptr<DenseMap> kept() const {
    auto dense = std::make_unique<DenseMap>(camera, coarse());
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const RgbdFrame& f = frames[i].rgbd;
      dense->add(KeyframeId{static_cast<std::uint32_t>(i)}, f.timestamp, f.color, f.depth, people(i));
    }
    return dense;
  }
  [[nodiscard]] std::map<KeyframeId, ViewSituation> true_situations() const {
    std::map<KeyframeId, ViewSituation> situations;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      situations[KeyframeId{static_cast<std::uint32_t>(i)}] = {frames[i].T_wc.inverse(), {}};
    }
    return situations;
  }
  // Large voxels, for speed: nothing here depends on their size.
  static DenseOptions coarse() {
    DenseOptions options;
    options.volume.voxel = 0.03;
    options.volume.truncation = 0.12;
    return options;
  }

  Camera camera;
  std::vector<SyntheticFrame> frames;
  std::vector<cv::Mat> masks;
  int person = 0;
};

const Room& room() {
  static const Room room;
  return room;
}

std::string bytes_of(DenseMap& dense) {
  return cloud_ply(dense.cloud().cloud, CloudColors::kImage);
}

// As after a loop was closed: the later a view, the more it moves.
std::map<KeyframeId, ViewSituation> bent(std::map<KeyframeId, ViewSituation> situations, double by) {
  for (auto& [id, situation] : situations) {
    Vector6d twist = Vector6d::Zero();
    twist[0] = by * id.value, twist[4] = 0.3 * by * id.value;
    situation.T_cw = SE3::exp(twist) * situation.T_cw;
  }
  return situations;
}

TEST(DenseMap, ShowsTheRoom) {
  const auto dense = room().kept();
  EXPECT_EQ(dense->follow(room().true_situations()), static_cast<std::size_t>(kViews));
  const DenseMap::Result result = dense->cloud();
  EXPECT_GT(result.cloud.points.size(), 2000U);
}

TEST(DenseMap, FollowsPosesToTheBytesOfAMapMadeWithThem) {
  const auto followed = room().kept();
  followed->follow(bent(room().true_situations(), 0.03));
  followed->follow(room().true_situations(), 0.0, 2);  // some of them
  followed->follow(room().true_situations());

  const auto fresh = room().kept();
  fresh->follow(room().true_situations());
  EXPECT_EQ(bytes_of(*followed), bytes_of(*fresh));
}

TEST(DenseMap, TakesInAnewOnlyWhatMoved) {
  const auto dense = room().kept();
  auto situations = room().true_situations();
  dense->follow(situations);
  EXPECT_EQ(dense->follow(situations), 0U);
  Vector6d twist = Vector6d::Zero();
  twist[1] = 0.01;
  situations[KeyframeId{3}].T_cw = SE3::exp(twist) * situations[KeyframeId{3}].T_cw;
  EXPECT_EQ(dense->follow(situations, 0.02), 0U) << "within the tolerance";
  EXPECT_EQ(dense->follow(situations, 0.005), 1U);
  EXPECT_EQ(dense->rebuilds(), 0U);

  const auto fresh = room().kept();
  fresh->follow(situations);
  EXPECT_EQ(bytes_of(*dense), bytes_of(*fresh));
}

TEST(DenseMap, BeginsAnewWhenMostOfItMoved) {
  const auto dense = room().kept();
  dense->follow(bent(room().true_situations(), 0.05));
  dense->follow(room().true_situations());
  EXPECT_EQ(dense->rebuilds(), 1U);
  EXPECT_EQ(dense->size(), static_cast<std::size_t>(kViews));
}

TEST(DenseMap, TakesOutWhatIsNotWanted) {
  const auto dense = room().kept();
  auto situations = room().true_situations();
  dense->follow(situations);
  situations.erase(KeyframeId{0});
  dense->follow(situations);
  EXPECT_EQ(dense->in_volume(KeyframeId{0}), nullptr);

  const auto fresh = room().kept();
  fresh->follow(situations);
  EXPECT_EQ(bytes_of(*dense), bytes_of(*fresh));
}

TEST(DenseMap, LeavesOutWhoWasFoundToMoveAfterwards) {
  const auto points_on_person = [&](DenseMap& dense) {
    // Points on the person: in front of everything else in the middle of the first view.
    const SE3 T_cw = room().frames[0].T_wc.inverse();
    const cv::Mat mask = room().masks[0] == room().person;
    std::size_t on_person = 0;
    for (const CloudPoint& p : dense.cloud().cloud.points) {
      const Eigen::Vector3d c = T_cw * p.position.cast<double>();
      if (c.z() < 0.3) continue;
      const Eigen::Vector2d pixel = room().camera.project(c);
      const cv::Point at(static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y())));
      if (!cv::Rect({}, mask.size()).contains(at) || mask.at<std::uint8_t>(at) == 0) continue;
      on_person += std::abs(room().frames[0].true_depth.at<float>(at) - c.z()) < 0.06 ? 1U : 0U;
    }
    return on_person;
  };
  const auto dense = room().kept();
  auto situations = room().true_situations();
  dense->follow(situations);
  EXPECT_GT(points_on_person(*dense), 100U);
  for (auto& [id, situation] : situations) situation.moved = {InstanceId{7}};
  dense->follow(situations, 1.0);  // nobody's pose changed, but who moves did
  EXPECT_EQ(points_on_person(*dense), 0U);
}

}  // namespace
}  // namespace ipl_slam
