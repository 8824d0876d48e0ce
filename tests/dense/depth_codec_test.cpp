#include "dense/depth_codec.hpp"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "common/byte_stream.hpp"
#include "common/random.hpp"

namespace ipl_slam {
namespace {

using Depth = cv::Mat_<std::uint16_t>;

bool equal(const cv::Mat& a, const cv::Mat& b) {
  return a.type() == b.type() && a.size() == b.size() && cv::norm(a, b, cv::NORM_INF) == 0.0;
}

void expect_round_trip(const cv::Mat& depth, const char* what) {
  EXPECT_TRUE(equal(unpack_depth(pack_depth(depth), depth.size()), depth)) << what;
}

// A slanting wall in the steps of a camera that measures disparity, with holes.
cv::Mat kinect_like_wall(cv::Size size) {
  Depth depth(size, std::uint16_t{0});
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const int disparity = 300 + x / 5 + (y + x) % 2;
      const bool hole = (x / 40 + y / 30) % 7 == 0;
      if (!hole) depth(y, x) = static_cast<std::uint16_t>(3'000'000 / disparity);
    }
  }
  return depth;
}

TEST(DepthCodec, GivesBackEveryKindOfImage) {
  expect_round_trip(Depth(5, 7, std::uint16_t{0}), "nothing measured");
  expect_round_trip(Depth(5, 7, std::uint16_t{65535}), "one depth, the largest");
  expect_round_trip((Depth(1, 1) << 1), "one pixel");
  expect_round_trip((Depth(2, 4) << 0, 1, 65535, 0, 1, 0, 65535, 2), "jumps and runs of one");
  expect_round_trip((Depth(1, 9) << 10, 20, 30, 20, 10, 0, 0, 20, 30), "runs of odd and even length");
  expect_round_trip(kinect_like_wall({640, 480}), "a wall");
}

TEST(DepthCodec, GivesBackNoise) {
  Random random(1);
  for (const unsigned largest : {3U, 40U, 65536U}) {
    Depth depth(37, 53);
    for (std::uint16_t& d : depth) d = static_cast<std::uint16_t>(random.index(largest));
    expect_round_trip(depth, "noise");
  }
  Depth all(256, 256);
  for (int i = 0; i < 65536; ++i) all(i / 256, i % 256) = static_cast<std::uint16_t>(i);
  expect_round_trip(all, "every depth there is");
}

TEST(DepthCodec, PacksAPartOfALargerImage) {
  const cv::Mat wall = kinect_like_wall({640, 480});
  expect_round_trip(wall(cv::Rect(31, 17, 200, 100)), "not continuous in memory");
}

TEST(DepthCodec, MakesMeasuredDepthSmaller) {
  const cv::Mat wall = kinect_like_wall({640, 480});
  // Pairs of differences take 4 bits in place of 32.
  EXPECT_LT(pack_depth(wall).size() * 7, wall.total() * wall.elemSize());
}

TEST(DepthCodec, RefusesWhatIsCutShortOrGoesOn) {
  const cv::Mat depth = kinect_like_wall({64, 48});
  const std::string bytes = pack_depth(depth);
  for (std::size_t size = 0; size + 1 < bytes.size(); ++size) {
    EXPECT_THROW((void)unpack_depth(bytes.substr(0, size), depth.size()), FormatError) << size;
  }
  EXPECT_THROW((void)unpack_depth(bytes + '\x01', depth.size()), FormatError);
  EXPECT_THROW((void)unpack_depth(bytes, {64, 47}), FormatError);
  EXPECT_THROW((void)unpack_depth(bytes, {64, 49}), FormatError);
}

TEST(DepthCodec, EndsWithAnImageOrARefusalWhateverTheBytesAre) {
  const cv::Mat depth = kinect_like_wall({64, 48});
  const std::string good = pack_depth(depth);
  Random random(2);
  int refused = 0;
  for (int i = 0; i < 2000; ++i) {
    std::string bytes = good;
    for (int k = 0; k < 3; ++k) bytes[random.index(bytes.size())] = static_cast<char>(random.index(256U));
    try {
      EXPECT_EQ(unpack_depth(bytes, depth.size()).size(), depth.size());
    } catch (const FormatError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 100);
}

TEST(DepthCodec, RefusesImagesThatAreNoDepth) {
  EXPECT_THROW((void)pack_depth(cv::Mat(4, 4, CV_8UC1)), std::invalid_argument);
}

TEST(DepthCodec, MakesKinectDepthFourTimesSmaller) {
  const char* data = std::getenv("IPL_SLAM_DATA");
  if (data == nullptr) GTEST_SKIP() << "needs IPL_SLAM_DATA with fr1_desk_100 in it";
  std::size_t raw = 0, packed = 0;
  int images = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::path(data) / "fr1_desk_100/depth")) {
    if (++images % 10 != 0) continue;
    const cv::Mat depth = cv::imread(entry.path().string(), cv::IMREAD_UNCHANGED);
    expect_round_trip(depth, entry.path().c_str());
    raw += depth.total() * depth.elemSize();
    packed += pack_depth(depth).size();
  }
  EXPECT_GT(raw, 4 * packed);
}

}  // namespace
}  // namespace ipl_slam
