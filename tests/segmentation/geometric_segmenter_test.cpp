#include "segmentation/geometric_segmenter.hpp"

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "dataset/synthetic/synthetic_source.hpp"
#include "evaluation/mask_score.hpp"

namespace ipl_slam {
namespace {

// Small pictures: rendering takes nearly all of the time.
SyntheticOptions scene(const std::string& trajectory, int people, int boxes, std::uint64_t seed) {
  SyntheticOptions options;
  options.width = 320;
  options.height = 240;
  options.trajectory = trajectory;
  options.people = people;
  options.boxes = boxes;
  options.seed = seed;
  options.frames = 70;
  return options;
}

BitMask all_of(const std::vector<Instance>& instances, cv::Size size) {
  BitMask all(size);
  for (const Instance& instance : instances) all |= instance.mask;
  return all;
}

// Pixels of objects that move now or moved within the last second: of those that cover more than 5 % of the
// image (to be found), and of the others (may be found).
struct Movers {
  cv::Mat large, small;
};

Movers recent_movers(const SyntheticSource& source, const cv::Mat& ids, std::size_t frame) {
  const auto second = static_cast<std::size_t>(source.options().fps);
  Movers movers{cv::Mat::zeros(ids.size(), CV_8UC1), cv::Mat::zeros(ids.size(), CV_8UC1)};
  for (const SyntheticObject& object : source.objects()) {
    bool moved = false;
    for (std::size_t k = frame > second ? frame - second : 0; k <= frame; ++k) {
      moved = moved || source.moves(object.id, k);
    }
    if (!moved) continue;
    const cv::Mat pixels = ids == object.id;
    (cv::countNonZero(pixels) * 20 > ids.size().area() ? movers.large : movers.small) |= pixels;
  }
  return movers;
}

// Score over the frames after the first second, before which there is little to know; every `step`th frame is
// shown.
MaskScore score_of(const SyntheticOptions& options, std::size_t step) {
  const SyntheticSource source(options, 0);
  GeometricSegmenter segmenter(source.camera());
  MaskScore score;
  for (std::size_t k = 0; k < source.size(); k += step) {
    const SyntheticFrame frame = source.render(k);
    const std::vector<Instance> found = segmenter.segment(frame.rgbd);
    if (static_cast<double>(k) < options.fps) continue;
    const Movers movers = recent_movers(source, frame.mask, k);
    BitMask mask = all_of(found, frame.mask.size());
    mask -= BitMask::from_image(movers.small);
    score.add(mask, BitMask::from_image(movers.large));
  }
  return score;
}

void expect_found(const MaskScore& score) {
  EXPECT_GT(score.hits + score.misses, 0) << "the scene has no large mover";
  EXPECT_GE(score.recall(), 0.7);
  EXPECT_GE(score.precision(), 0.7);
}

// Scenes that were not looked at when the settings were chosen, judged together: which of them has movers
// that show little differs.
TEST(GeometricSegmenter, FindsPeopleInScenesItHasNotSeen) {
  MaskScore score = score_of(scene("rpy", 3, 1, 201), 3);
  score += score_of(scene("xyz", 3, 1, 202), 3);
  score += score_of(scene("static", 3, 1, 203), 3);
  expect_found(score);
}

TEST(GeometricSegmenter, FindsPeopleThoughFramesAreLeftOut) {
  expect_found(score_of(scene("xyz", 3, 4, 8), 6));
}

TEST(GeometricSegmenter, FindsNothingWhereOnlyTheCameraMoves) {
  for (const std::string trajectory : {"rpy", "sweep"}) {
    SyntheticOptions options = scene(trajectory, 0, 0, 12);
    const MaskScore score = score_of(options, 4);
    EXPECT_LT(score.false_area(), 0.002) << trajectory;
  }
}

TEST(GeometricSegmenter, GivesInstancesThatFitTheImage) {
  const SyntheticSource source(scene("static", 2, 0, 7), 0);
  GeometricSegmenter segmenter(source.camera());
  std::size_t found = 0;
  for (std::size_t k = 0; k < source.size(); k += 3) {
    float last_score = 1.0F;
    for (const Instance& instance : segmenter.segment(source.render(k).rgbd)) {
      ++found;
      EXPECT_EQ(instance.class_name, "unknown");
      EXPECT_EQ(instance.mask.size(), cv::Size(320, 240));
      EXPECT_EQ(instance.box, instance.mask.bounding_box());
      EXPECT_FALSE(instance.box.empty());
      EXPECT_GE(instance.score, 0.0F);
      EXPECT_LE(instance.score, last_score);
      last_score = instance.score;
    }
  }
  EXPECT_GT(found, 0U);
}

TEST(GeometricSegmenter, GivesTheSameForTheSame) {
  const SyntheticSource source(scene("xyz", 3, 0, 8), 0);
  GeometricSegmenter a(source.camera()), b(source.camera());
  for (std::size_t k = 0; k < source.size(); k += 5) {
    const RgbdFrame frame = source.render(k).rgbd;
    const std::vector<Instance> of_a = a.segment(frame), of_b = b.segment(frame);
    ASSERT_EQ(of_a.size(), of_b.size());
    for (std::size_t i = 0; i < of_a.size(); ++i) EXPECT_EQ(of_a[i].mask, of_b[i].mask);
  }
}

TEST(GeometricSegmenter, SurvivesImagesThatShowNothing) {
  const SyntheticSource source(scene("xyz", 2, 0, 8), 0);
  const cv::Size size(320, 240);
  GeometricSegmenter segmenter(source.camera());
  for (std::size_t k = 0; k < 12; ++k) {
    RgbdFrame frame = source.render(k).rgbd;
    if (k % 4 == 1) frame.depth = cv::Mat::zeros(size, CV_16UC1);
    if (k % 4 == 2) frame.color = cv::Mat(size, CV_8UC1, cv::Scalar(128));
    if (k % 4 == 3) {
      frame.color = cv::Mat::zeros(size, CV_8UC3);
      frame.depth = cv::Mat(size, CV_16UC1, cv::Scalar(65535));
    }
    EXPECT_NO_THROW((void)segmenter.segment(frame)) << k;
  }
}

TEST(GeometricSegmenter, RefusesImagesOfAnotherSize) {
  GeometricSegmenter segmenter{Camera()};
  RgbdFrame frame;
  frame.color = cv::Mat::zeros(240, 320, CV_8UC3);
  frame.depth = cv::Mat::zeros(240, 320, CV_16UC1);
  EXPECT_THROW((void)segmenter.segment(frame), std::invalid_argument);
}

}  // namespace
}  // namespace ipl_slam
