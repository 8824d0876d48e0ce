#include "segmentation/yolo_output.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "common/random.hpp"

namespace ipl_slam {
namespace {

/// A network's output in memory of its own.
struct MadeOutput {
  MadeOutput(int anchors, int classes, int coefficients, cv::Size prototype_size)
      : channels(static_cast<std::size_t>((4 + classes + coefficients) * anchors)),
        prototypes(static_cast<std::size_t>(coefficients * prototype_size.area())) {
    output = {channels.data(), prototypes.data(), anchors, classes, coefficients, prototype_size};
  }
  float& at(int channel, int anchor) {
    return channels[static_cast<std::size_t>(channel * output.anchors + anchor)];
  }

  std::vector<float> channels, prototypes;
  YoloOutput output;
};

TEST(FindCandidates, TakesTheBestClassOfEachAnchorThatScoresEnough) {
  MadeOutput made(3, 2, 1, {1, 1});
  const float boxes[] = {50.0F, 40.0F, 20.0F, 10.0F};
  for (int i = 0; i < 4; ++i) made.at(i, 1) = boxes[i];
  made.at(4, 0) = 0.29F;  // below the limit
  made.at(4, 1) = 0.4F;
  made.at(5, 1) = 0.7F;
  made.at(4, 2) = 0.3F;  // on it
  const auto found = find_candidates(made.output, 0.3F, {true, true});
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].anchor, 1);
  EXPECT_EQ(found[0].class_index, 1);
  EXPECT_FLOAT_EQ(found[0].score, 0.7F);
  EXPECT_FLOAT_EQ(found[0].x0, 40.0F);
  EXPECT_FLOAT_EQ(found[0].y0, 35.0F);
  EXPECT_FLOAT_EQ(found[0].x1, 60.0F);
  EXPECT_FLOAT_EQ(found[0].y1, 45.0F);
  EXPECT_EQ(found[1].anchor, 2);
}

TEST(FindCandidates, LeavesOutAnchorsWhoseBestClassIsNotWanted) {
  MadeOutput made(1, 2, 1, {1, 1});
  made.at(4, 0) = 0.5F;
  made.at(5, 0) = 0.9F;
  EXPECT_TRUE(find_candidates(made.output, 0.3F, {true, false}).empty());
  EXPECT_EQ(find_candidates(made.output, 0.3F, {false, true}).size(), 1U);
}

TEST(FindCandidates, TakesNoScoreThatIsNotANumber) {
  MadeOutput made(1, 1, 1, {1, 1});
  made.at(4, 0) = std::nanf("");
  EXPECT_TRUE(find_candidates(made.output, 0.3F, {true}).empty());
}

TEST(ImageBox, HoldsThePixelsWhoseCentresLieInTheDetection) {
  const Letterbox letterbox({640, 480}, {640, 640});  // 80 rows above
  Detection detection{10.4F, 90.6F, 20.4F, 100.6F};
  EXPECT_EQ(image_box(detection, letterbox), cv::Rect(10, 11, 10, 10));
}

TEST(ImageBox, StaysInTheImage) {
  const Letterbox letterbox({640, 480}, {640, 640});
  EXPECT_EQ(image_box({-5, 0, 700, 640}, letterbox), cv::Rect(0, 0, 640, 480));
  EXPECT_TRUE(image_box({10, 0, 50, 79}, letterbox).empty());  // in the padding
  EXPECT_TRUE(image_box({30, 100, 20, 90}, letterbox).empty());
  EXPECT_TRUE(image_box({std::nanf(""), 100, 20, 90}, letterbox).empty());
}

/// One detection whose mask is the half plane right of (or below) an edge, given in input pixels.
/// Interpolated linearly, a ramp is exact everywhere but at the rim, so the edge is where it was put.
MadeOutput ramp(cv::Size input, double edge, bool along_x) {
  MadeOutput made(1, 1, 1, {input.width / 4, input.height / 4});
  made.at(5, 0) = 1.0F;
  for (int y = 0; y < input.height / 4; ++y) {
    for (int x = 0; x < input.width / 4; ++x) {
      made.prototypes[static_cast<std::size_t>(y * (input.width / 4) + x)] =
          static_cast<float>(4.0 * ((along_x ? x : y) + 0.5) - edge);
    }
  }
  return made;
}

TEST(DecodeMask, PutsAnEdgeWhereItLiesInTheImage) {
  for (const cv::Size image :
       {cv::Size(640, 480), cv::Size(320, 240), cv::Size(1280, 720), cv::Size(333, 517)}) {
    for (const cv::Size input : {cv::Size(640, 640), cv::Size(320, 256), cv::Size(480, 384)}) {
      const Letterbox letterbox(image, input);
      for (const double share : {0.21, 0.5, 0.77}) {
        const cv::Point2d edge(image.width * share + 0.13, image.height * share + 0.13);
        const cv::Point2d in_input = letterbox.to_input(edge);
        const cv::Rect all({0, 0}, image);
        const BitMask right = decode_mask(ramp(input, in_input.x, true).output, {}, all, letterbox);
        const BitMask below = decode_mask(ramp(input, in_input.y, false).output, {}, all, letterbox);
        // The first pixel whose centre lies beyond the edge.
        const int x = static_cast<int>(std::ceil(edge.x - 0.5)),
                  y = static_cast<int>(std::ceil(edge.y - 0.5));
        EXPECT_EQ(right.bounding_box(), cv::Rect(cv::Point(x, 0), cv::Point(image))) << image << input;
        EXPECT_EQ(below.bounding_box(), cv::Rect(cv::Point(0, y), cv::Point(image))) << image << input;
        EXPECT_EQ(right.area(), (image.width - x) * image.height);
        EXPECT_EQ(below.area(), image.width * (image.height - y));
      }
    }
  }
}

/// The mask's value at a pixel, as the formula says it: the sum at the four prototype pixels around its
/// centre.
double slow_value(const YoloOutput& output, int anchor, const Letterbox& letterbox, int x, int y) {
  const cv::Point2d input = letterbox.to_input({x + 0.5, y + 0.5});
  const cv::Size size = output.prototype_size;
  const double px = std::clamp(input.x * size.width / letterbox.input.width - 0.5, 0.0, size.width - 1.0);
  const double py = std::clamp(input.y * size.height / letterbox.input.height - 0.5, 0.0, size.height - 1.0);
  double value = 0.0;
  for (int v = static_cast<int>(py); v <= std::min(static_cast<int>(py) + 1, size.height - 1); ++v) {
    for (int u = static_cast<int>(px); u <= std::min(static_cast<int>(px) + 1, size.width - 1); ++u) {
      double sum = 0.0;
      for (int k = 0; k < output.coefficients; ++k) {
        sum += static_cast<double>(output.channel(4 + output.classes + k)[anchor]) *
               output.prototype(k)[v * size.width + u];
      }
      value += sum * (1.0 - std::abs(px - u)) * (1.0 - std::abs(py - v));
    }
  }
  return value;
}

TEST(DecodeMask, AgreesWithTheSlowFormulaInsideTheBoxAndIsEmptyOutside) {
  Random random(7);
  for (const cv::Size image : {cv::Size(160, 120), cv::Size(131, 77), cv::Size(61, 150)}) {
    const cv::Size input(128, 96);
    MadeOutput made(5, 3, 8, {32, 24});
    for (float& value : made.channels) value = static_cast<float>(random.uniform(-1.0, 1.0));
    for (float& value : made.prototypes) value = static_cast<float>(random.uniform(-1.0, 1.0));
    const Letterbox letterbox(image, input);
    for (const cv::Rect box : {cv::Rect({0, 0}, image), cv::Rect(17, 9, 31, 40), cv::Rect(0, 0, 1, 1),
                               cv::Rect(image.width - 3, image.height - 2, 3, 2)}) {
      Detection detection;
      detection.anchor = 3;
      const BitMask mask = decode_mask(made.output, detection, box, letterbox);
      ASSERT_EQ(mask.size(), image);
      for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
          if (!box.contains({x, y})) {
            ASSERT_FALSE(mask.test(x, y));
            continue;
          }
          const double value = slow_value(made.output, 3, letterbox, x, y);
          // Eight products of numbers up to 1 in single precision: the sign is sure beyond 1e-5.
          if (std::abs(value) > 1e-5) {
            ASSERT_EQ(mask.test(x, y), value > 0.0) << x << ' ' << y;
          }
        }
      }
    }
  }
}

TEST(DecodeMask, IsEmptyForAnEmptyBox) {
  MadeOutput made(1, 1, 1, {8, 8});
  EXPECT_TRUE(decode_mask(made.output, {}, {}, Letterbox({64, 64}, {32, 32})).none());
}

}  // namespace
}  // namespace ipl_slam
