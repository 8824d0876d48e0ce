#include "dense/label_codec.hpp"

#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "common/byte_stream.hpp"
#include "common/random.hpp"

namespace ipl_slam {
namespace {

using Labels = cv::Mat_<std::uint8_t>;

void expect_round_trip(const cv::Mat& labels) {
  const cv::Mat back = unpack_labels(pack_labels(labels), labels.size());
  ASSERT_EQ(back.type(), CV_8UC1);
  EXPECT_EQ(cv::norm(back, labels, cv::NORM_INF), 0.0);
}

Labels two_things() {
  Labels labels(48, 64, std::uint8_t{0});
  labels(cv::Rect(5, 6, 20, 30)) = 1;
  labels(cv::Rect(15, 20, 31, 9)) = 255;
  return labels;
}

TEST(LabelCodec, GivesBackEveryImage) {
  expect_round_trip(Labels(1, 1, std::uint8_t{7}));
  expect_round_trip(Labels(480, 640, std::uint8_t{0}));
  expect_round_trip(two_things());
  expect_round_trip(two_things()(cv::Rect(3, 3, 30, 30)));
  Random random(1);
  Labels noise(37, 53);
  for (std::uint8_t& label : noise) label = static_cast<std::uint8_t>(random.index(256U));
  expect_round_trip(noise);
}

TEST(LabelCodec, TakesBytesForAnImageWithoutAnybody) {
  EXPECT_LE(pack_labels(Labels(480, 640, std::uint8_t{0})).size(), 8U);
}

TEST(LabelCodec, RefusesWhatIsNotOfThisImage) {
  const Labels labels = two_things();
  const std::string bytes = pack_labels(labels);
  for (std::size_t size = 0; size + 1 < bytes.size(); ++size) {
    EXPECT_THROW((void)unpack_labels(bytes.substr(0, size), labels.size()), FormatError) << size;
  }
  EXPECT_THROW((void)unpack_labels(bytes + '\x01', labels.size()), FormatError);
  EXPECT_THROW((void)unpack_labels(bytes, {64, 47}), FormatError);
  EXPECT_THROW((void)unpack_labels("\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF", {64, 48}), FormatError);
  EXPECT_THROW((void)pack_labels(cv::Mat(4, 4, CV_16UC1)), std::invalid_argument);
}

}  // namespace
}  // namespace ipl_slam
