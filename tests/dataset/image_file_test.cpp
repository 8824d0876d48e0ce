#include "dataset/image_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "dataset/temporary_folder.hpp"

namespace ipl_slam {
namespace {

using ::testing::HasSubstr;
using testing::TemporaryFolder;

/// Not smooth, so that the coded pixels fill many bytes.
cv::Mat textured_image(int type) {
  cv::Mat image(48, 64, type);
  cv::RNG random(7);
  random.fill(image, cv::RNG::UNIFORM, 0, 200);
  return image;
}

std::string encoded(const std::string& extension, const cv::Mat& image,
                    const std::vector<int>& options = {}) {
  std::vector<unsigned char> bytes;
  cv::imencode(extension, image, bytes, options);
  return {bytes.begin(), bytes.end()};
}

class ImageFile : public ::testing::Test {
 protected:
  LoadedImage load(const std::string& bytes) { return load_image(folder_.write("image", bytes)); }

  TemporaryFolder folder_;
};

TEST_F(ImageFile, ReadsPngPixelsAsStored) {
  for (const int type : {CV_8UC1, CV_8UC3, CV_8UC4, CV_16UC1}) {
    const cv::Mat image = textured_image(type);
    const LoadedImage loaded = load(encoded(".png", image));
    ASSERT_EQ(loaded.image.type(), type) << loaded.detail;
    EXPECT_EQ(cv::norm(image, loaded.image, cv::NORM_INF), 0.0);
  }
}

TEST_F(ImageFile, ReadsJpegWithAndWithoutRestartMarkersAndProgressive) {
  const cv::Mat image = textured_image(CV_8UC3);
  for (const std::vector<int>& options : {std::vector<int>{},
                                          {cv::IMWRITE_JPEG_PROGRESSIVE, 1},
                                          {cv::IMWRITE_JPEG_RST_INTERVAL, 2},
                                          {cv::IMWRITE_JPEG_OPTIMIZE, 1}}) {
    const LoadedImage loaded = load(encoded(".jpg", image, options));
    EXPECT_EQ(loaded.image.type(), CV_8UC3) << loaded.detail;
    EXPECT_EQ(loaded.image.size(), image.size());
  }
}

// Wherever the file is cut: no decoder may make up the rest.
TEST_F(ImageFile, TakesNoPartOfAFileForTheWhole) {
  for (const char* extension : {".png", ".jpg"}) {
    const std::string bytes = encoded(extension, textured_image(CV_8UC3));
    for (const std::size_t kept :
         {std::size_t{0}, std::size_t{20}, bytes.size() / 2, bytes.size() - 12, bytes.size() - 1}) {
      const LoadedImage loaded = load(bytes.substr(0, kept));
      EXPECT_TRUE(loaded.image.empty()) << extension << " cut to " << kept;
      EXPECT_EQ(loaded.problem, "truncated") << extension << " cut to " << kept;
    }
  }
}

TEST_F(ImageFile, IsNotMisledByAThumbnailThatEndsInsideATruncatedJpeg) {
  const std::string bytes = encoded(".jpg", textured_image(CV_8UC3));
  const std::string thumbnail = encoded(".jpg", textured_image(CV_8UC1));
  const std::size_t length = thumbnail.size() + 2;
  ASSERT_LT(length, 65536u);
  const std::string segment =
      std::string("\xFF\xE1") + static_cast<char>(length >> 8) + static_cast<char>(length & 255) + thumbnail;
  const std::string whole = bytes.substr(0, 2) + segment + bytes.substr(2);
  EXPECT_TRUE(jpeg_is_complete(whole));
  EXPECT_FALSE(jpeg_is_complete(whole.substr(0, whole.size() - 2)));
}

TEST_F(ImageFile, ToleratesBytesAfterTheEnd) {
  EXPECT_FALSE(load(encoded(".png", textured_image(CV_16UC1)) + std::string(10, '\0')).image.empty());
  EXPECT_FALSE(load(encoded(".jpg", textured_image(CV_8UC3)) + std::string(10, '\0')).image.empty());
}

TEST_F(ImageFile, ReportsDamagedPixels) {
  std::string bytes = encoded(".png", textured_image(CV_8UC3));
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 0x55);
  const LoadedImage loaded = load(bytes);
  EXPECT_TRUE(loaded.image.empty());
  EXPECT_EQ(loaded.problem, "unreadable");
}

TEST_F(ImageFile, ReportsWhatIsNoImage) {
  const LoadedImage loaded = load("version https://git-lfs.github.com/spec/v1\n");
  EXPECT_EQ(loaded.problem, "unreadable");
  EXPECT_THAT(loaded.detail, HasSubstr("neither PNG nor JPEG"));
  EXPECT_EQ(load_image(folder_.path()).problem, "unreadable");
  EXPECT_EQ(load_image(folder_ / "none.png").problem, "missing");
}

}  // namespace
}  // namespace ipl_slam
