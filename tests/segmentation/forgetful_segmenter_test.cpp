#include "segmentation/forgetful_segmenter.hpp"

#include <array>
#include <cmath>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "segmentation/make_segmenter.hpp"

namespace ipl_slam {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr int kDetections = 4;  // in every frame

/// Finds the same things in every frame, told apart by their boxes.
class SeesAll : public Segmenter {
 public:
  [[nodiscard]] std::vector<Instance> segment(const RgbdFrame&) override {
    std::vector<Instance> found(kDetections);
    for (int i = 0; i < kDetections; ++i) found[static_cast<std::size_t>(i)].box.x = i;
    return found;
  }
  [[nodiscard]] std::string name() const override { return "sees all"; }
  [[nodiscard]] std::vector<std::string> remarks() const override { return {"a remark of its own"}; }
};

ForgetfulSegmenter forgetful(double miss_rate, std::uint64_t seed = 0) {
  return {std::make_unique<SeesAll>(), miss_rate, seed};
}

/// What is left of a frame's detections, as a bit each.
unsigned kept(Segmenter& segmenter, std::size_t frame) {
  RgbdFrame image;
  image.index = frame;
  unsigned bits = 0;
  int last = -1;
  for (const Instance& instance : segmenter.segment(image)) {
    EXPECT_GT(instance.box.x, last) << "the order must stay";
    last = instance.box.x;
    bits |= 1U << instance.box.x;
  }
  return bits;
}

std::vector<unsigned> kept_in(Segmenter& segmenter, std::size_t frames) {
  std::vector<unsigned> result;
  for (std::size_t i = 0; i < frames; ++i) result.push_back(kept(segmenter, i));
  return result;
}

TEST(ForgetfulSegmenter, ForgetsTheShareItIsAskedFor) {
  constexpr int kFrames = 5000;
  for (const double rate : {0.1, 0.3, 0.8}) {
    for (const std::uint64_t seed : {0U, 1U, 77U}) {
      ForgetfulSegmenter segmenter = forgetful(rate, seed);
      std::array<int, kDetections> forgotten{};
      int first_two = 0;
      for (const unsigned bits : kept_in(segmenter, kFrames)) {
        for (unsigned i = 0; i < kDetections; ++i) forgotten[i] += (bits >> i & 1U) == 0;
        first_two += (bits & 3U) == 0;
      }
      // Within 4.5 standard deviations of a binomial distribution: 3e-5 of all seeds would fail somewhere.
      const auto tolerance = [](double p) { return 4.5 * std::sqrt(kFrames * p * (1.0 - p)); };
      for (const int count : forgotten) EXPECT_NEAR(count, kFrames * rate, tolerance(rate)) << seed;
      EXPECT_NEAR(first_two, kFrames * rate * rate, tolerance(rate * rate))
          << "independent of each other, seed " << seed;
    }
  }
}

TEST(ForgetfulSegmenter, OneFrameSaysNothingAboutTheNext) {
  constexpr int kFrames = 5000;
  ForgetfulSegmenter segmenter = forgetful(0.5);
  const std::vector<unsigned> bits = kept_in(segmenter, kFrames);
  int both = 0;
  for (std::size_t i = 1; i < bits.size(); ++i) both += (bits[i - 1] & bits[i] & 1U) == 0 ? 0 : 1;
  EXPECT_NEAR(both, kFrames * 0.25, 4.5 * std::sqrt(kFrames * 0.25 * 0.75));
}

TEST(ForgetfulSegmenter, ForgetsTheSameWithTheSameSeedAndOthersWithAnother) {
  ForgetfulSegmenter a = forgetful(0.5, 3), b = forgetful(0.5, 3), c = forgetful(0.5, 4);
  const std::vector<unsigned> first = kept_in(a, 100);
  EXPECT_EQ(first, kept_in(b, 100));
  EXPECT_NE(first, kept_in(c, 100));
}

TEST(ForgetfulSegmenter, AFrameLosesTheSameWhicheverFramesCameBefore) {
  ForgetfulSegmenter all = forgetful(0.5), some = forgetful(0.5);
  const std::vector<unsigned> bits = kept_in(all, 100);
  for (std::size_t i = 0; i < 100; i += 7) EXPECT_EQ(kept(some, i), bits[i]);
}

TEST(ForgetfulSegmenter, ForgetsNothingAtZeroAndEverythingAtOne) {
  ForgetfulSegmenter nothing = forgetful(0.0), everything = forgetful(1.0);
  for (std::size_t i = 0; i < 200; ++i) {
    EXPECT_EQ(kept(nothing, i), (1U << kDetections) - 1);
    EXPECT_EQ(kept(everything, i), 0U);
  }
}

TEST(ForgetfulSegmenter, SaysWhatItDid) {
  ForgetfulSegmenter segmenter = forgetful(1.0);
  (void)kept_in(segmenter, 2);
  EXPECT_EQ(segmenter.name(), "sees all");
  EXPECT_THAT(segmenter.remarks(), ElementsAre("a remark of its own", HasSubstr("8 of 8 detections")));
}

TEST(ForgetfulSegmenter, RefusesNonsense) {
  EXPECT_THROW(forgetful(-0.1), std::invalid_argument);
  EXPECT_THROW(forgetful(1.1), std::invalid_argument);
  EXPECT_THROW(ForgetfulSegmenter(nullptr, 0.5, 0), std::invalid_argument);
}

TEST(MakeSegmenter, ForgetsOnlyWhereItIsAskedTo) {
  Camera camera;
  camera.width = 64;
  camera.height = 48;
  camera.fx = camera.fy = 50.0;
  camera.cx = 31.5;
  camera.cy = 23.5;
  SegmentationOptions options;
  options.segmenter = "geometric";
  EXPECT_THAT(make_segmenter(options, camera)->remarks(), IsEmpty());
  options.miss_rate = 0.3;
  EXPECT_THAT(make_segmenter(options, camera)->remarks(), ElementsAre(HasSubstr("miss_rate = 0.3")));
  options.segmenter = "none";
  EXPECT_EQ(make_segmenter(options, camera), nullptr);
}

}  // namespace
}  // namespace ipl_slam
