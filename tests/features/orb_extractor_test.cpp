#include "features/orb_extractor.hpp"

#include <cmath>
#include <cstring>
#include <numbers>
#include <numeric>
#include <stdexcept>

#include <gtest/gtest.h>

#include "features/matcher.hpp"
#include "features/test_images.hpp"

namespace ipl_slam {
namespace {

constexpr int kWidth = 320, kHeight = 240;

OrbOptions small_options() {
  OrbOptions options;
  options.features = 500;
  return options;
}

Features extract(const cv::Mat& image, const cv::Mat& depth = {}, const OrbOptions& options = small_options(),
                 ThreadPool* pool = nullptr) {
  OrbExtractor extractor(options, test::simple_camera(image.cols, image.rows), DepthNoiseOptions{}, pool);
  return extractor.extract(image, depth);
}

void expect_same(const Features& a, const Features& b) {
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(a.descriptors, b.descriptors);
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Keypoint &p = a.keypoints[i], &q = b.keypoints[i];
    EXPECT_EQ(p.pixel, q.pixel);
    EXPECT_EQ(p.undistorted, q.undistorted);
    EXPECT_EQ(p.angle, q.angle);
    EXPECT_EQ(p.response, q.response);
    EXPECT_EQ(p.depth, q.depth);
    EXPECT_EQ(p.level, q.level);
  }
}

TEST(OrbExtractor, GivesTheSameBytesTwiceAndOnAnyNumberOfThreads) {
  const cv::Mat image = test::textured_image(kWidth, kHeight);
  const cv::Mat depth = test::constant_depth(kWidth, kHeight, 10000);
  const Features once = extract(image, depth);
  ASSERT_GT(once.size(), 400U);
  expect_same(once, extract(image, depth));
  for (const int threads : {1, 2, 3}) {
    ThreadPool pool(threads);
    expect_same(once, extract(image, depth, small_options(), &pool));
  }
}

TEST(OrbExtractor, AFrameLeavesNothingBehindForTheNext) {
  OrbExtractor extractor(small_options(), test::simple_camera(kWidth, kHeight), DepthNoiseOptions{});
  const cv::Mat first = test::textured_image(kWidth, kHeight, 1);
  const cv::Mat second = test::textured_image(kWidth, kHeight, 2, 60);
  const Features fresh = extract(second);
  static_cast<void>(extractor.extract(first, cv::Mat()));
  expect_same(fresh, extractor.extract(second, cv::Mat()));
}

TEST(OrbExtractor, KeepsToTheQuotaOfFeatures) {
  const cv::Mat image = test::textured_image(640, 480, 1, 3000);
  OrbOptions options;
  for (const int wanted : {100, 357, 1000}) {
    options.features = wanted;
    EXPECT_EQ(extract(image, {}, options).size(), static_cast<std::size_t>(wanted));
  }
}

TEST(OrbExtractor, QuotasFallByTheScaleFactorAndSumToTheWhole) {
  const OrbOptions options;
  const std::vector<int> quotas = level_quotas(options);
  ASSERT_EQ(quotas.size(), 8U);
  EXPECT_EQ(std::accumulate(quotas.begin(), quotas.end(), 0), options.features);
  // Rounded to whole keypoints: each quota is within half of its share, so the ratio within a few per cent.
  for (std::size_t i = 1; i < quotas.size(); ++i) EXPECT_NEAR(1.0 * quotas[i - 1] / quotas[i], 1.2, 0.03);
}

TEST(OrbExtractor, LevelVariancesAreTheSquaredScales) {
  OrbOptions options;
  options.levels = 3;
  options.scale_factor = 1.5;
  const std::vector<double> sigma2 = level_sigma2(options);
  ASSERT_EQ(sigma2.size(), 3U);
  EXPECT_DOUBLE_EQ(sigma2[0], 1.0);
  EXPECT_DOUBLE_EQ(sigma2[1], 2.25);
  EXPECT_DOUBLE_EQ(sigma2[2], 5.0625);
}

TEST(OrbExtractor, CoversTheWholeImageThoughOneCornerOfItIsFarRicher) {
  // Strong texture in the left top quarter, weak texture elsewhere: by strength alone all would lie in that
  // quarter.
  cv::Mat image = test::textured_image(640, 480, 1, 3000);
  cv::Mat weak;
  image.convertTo(weak, CV_8UC1, 0.25, 96);
  image(cv::Rect(0, 0, 320, 240)).copyTo(weak(cv::Rect(0, 0, 320, 240)));
  OrbOptions options;
  options.spread = 1.0;
  const Features features = extract(weak, {}, options);
  int per_cell[4][3] = {};
  for (const Keypoint& k : features.keypoints) {
    ++per_cell[static_cast<int>(k.pixel.x()) / 160][static_cast<int>(k.pixel.y()) / 160];
  }
  // 12 cells share 1000 keypoints: 83 each if perfectly even; border cells lose the strip no patch fits in.
  for (const auto& column : per_cell) {
    for (const int count : column) EXPECT_GT(count, 40);
  }
  options.spread = 0.0;
  int in_quarter = 0;
  const Features strongest = extract(weak, {}, options);
  for (const Keypoint& k : strongest.keypoints) in_quarter += k.pixel.x() < 320 && k.pixel.y() < 240 ? 1 : 0;
  EXPECT_GT(in_quarter, 600);
}

TEST(OrbExtractor, FindsWeakCornersWhereThereAreNoStrongOnes) {
  cv::Mat image = test::textured_image(kWidth, kHeight);
  image.convertTo(image, CV_8UC1, 0.1, 115);  // contrasts of at most 25 grey levels, most below 20
  OrbOptions strict = small_options();
  strict.fast_min_threshold = strict.fast_threshold;
  const std::size_t adaptive = extract(image).size();
  EXPECT_GT(adaptive, 2 * extract(image, {}, strict).size());
  EXPECT_GT(adaptive, 100U);
}

TEST(OrbExtractor, APatchNeverReachesOverTheBorder) {
  const Features features = extract(test::noise_image(kWidth, kHeight));
  ASSERT_GT(features.size(), 400U);
  for (const Keypoint& k : features.keypoints) {
    const double border = 16.0 * std::pow(1.2, k.level) - 2.0 * std::pow(1.2, k.level);
    EXPECT_GT(k.pixel.x(), border);
    EXPECT_GT(k.pixel.y(), border);
    EXPECT_LT(k.pixel.x(), kWidth - 1 - border);
    EXPECT_LT(k.pixel.y(), kHeight - 1 - border);
    EXPECT_GE(k.level, 0);
    EXPECT_LT(k.level, 8);
  }
}

TEST(OrbExtractor, ABlackOrFlatImageHasNoFeatures) {
  EXPECT_EQ(extract(cv::Mat::zeros(kHeight, kWidth, CV_8UC1)).size(), 0U);
  EXPECT_EQ(extract(cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(255))).size(), 0U);
}

TEST(OrbExtractor, TinyImagesUseTheLevelsThatFitOrNone) {
  EXPECT_EQ(extract(test::noise_image(16, 16)).size(), 0U);
  EXPECT_EQ(extract(test::noise_image(32, 200)).size(), 0U);
  const Features features = extract(test::noise_image(36, 36));
  EXPECT_GT(features.size(), 0U);
  for (const Keypoint& k : features.keypoints) EXPECT_EQ(k.level, 0);
}

TEST(OrbExtractor, ColorImagesGiveTheFeaturesOfTheirGreyVersion) {
  cv::Mat color, grey;
  cv::merge(
      std::vector<cv::Mat>{test::textured_image(kWidth, kHeight, 1), test::textured_image(kWidth, kHeight, 2),
                           test::textured_image(kWidth, kHeight, 3)},
      color);
  cv::cvtColor(color, grey, cv::COLOR_BGR2GRAY);
  expect_same(extract(color), extract(grey));
}

TEST(OrbExtractor, RefusesImagesOfAnotherTypeOrSize) {
  OrbExtractor extractor(small_options(), test::simple_camera(kWidth, kHeight), DepthNoiseOptions{});
  const cv::Mat image = test::textured_image(kWidth, kHeight);
  EXPECT_THROW(static_cast<void>(extractor.extract(cv::Mat(), cv::Mat())), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(extractor.extract(cv::Mat(kHeight, kWidth, CV_16UC1), cv::Mat())),
               std::invalid_argument);
  EXPECT_THROW(static_cast<void>(extractor.extract(test::textured_image(kWidth, 200), cv::Mat())),
               std::invalid_argument);
  EXPECT_THROW(static_cast<void>(extractor.extract(image, image)), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(extractor.extract(image, test::constant_depth(100, 100, 1))),
               std::invalid_argument);
}

TEST(OrbExtractor, RefusesOptionsThatContradictEachOther) {
  const auto make = [](const OrbOptions& o) { OrbExtractor(o, test::simple_camera(kWidth, kHeight), {}); };
  OrbOptions options;
  options.fast_min_threshold = options.fast_threshold + 1;
  EXPECT_THROW(make(options), std::invalid_argument);
  options = {};
  options.scale_factor = 1.0;
  EXPECT_THROW(make(options), std::invalid_argument);
  options = {};
  options.spread = 1.5;
  EXPECT_THROW(make(options), std::invalid_argument);
}

// A bright square whose corner lies at a known fraction of a pixel: each border pixel is as bright as it is
// covered.
TEST(OrbExtractor, LocatesACornerBetweenPixels) {
  OrbOptions options = small_options();
  options.levels = 1;
  for (const double shift : {0.0, 0.25, 0.5, 0.75}) {
    cv::Mat image(100, 100, CV_64FC1);
    const auto covered = [](int i, double begin, double end) {
      return std::clamp(i + 0.5 - begin, 0.0, 1.0) * std::clamp(end - (i - 0.5), 0.0, 1.0);
    };
    for (int y = 0; y < 100; ++y) {
      for (int x = 0; x < 100; ++x) {
        image.at<double>(y, x) =
            40.0 + 160.0 * covered(x, 40.0 + shift, 60.0 + shift) * covered(y, 40.0, 60.0);
      }
    }
    cv::Mat smooth;
    cv::GaussianBlur(image, smooth, {9, 9}, 1.2);
    smooth.convertTo(smooth, CV_8UC1);
    const Features features = extract(smooth, {}, options);
    ASSERT_EQ(features.size(), 4U) << "shift " << shift;
    // The four corners are symmetric about the square's centre, whatever bias the detector has along the
    // diagonal.
    Eigen::Vector2f mean = Eigen::Vector2f::Zero();
    for (const Keypoint& k : features.keypoints) mean += k.pixel / 4.0F;
    // The score has no exact parabola: the fit overshoots by up to 0.2. Whole pixels would be off by up to
    // 0.5.
    EXPECT_NEAR(mean.x(), 50.0 + shift, 0.22) << "shift " << shift;
    EXPECT_NEAR(mean.y(), 50.0, 0.05) << "shift " << shift;
  }
}

// Share of matches that a known similarity maps to within three pixels of their level, and their number.
struct Agreement {
  int matches = 0;
  int right = 0;
};

Agreement agreement(const cv::Mat& image, const cv::Matx23d& map) {
  cv::Mat moved;
  cv::warpAffine(image, moved, map, image.size(), cv::INTER_LINEAR, cv::BORDER_REFLECT);
  const Features a = extract(image), b = extract(moved);
  Agreement result;
  for (const auto& [i, j] : match_brute_force(a, b, MatchOptions{})) {
    const Keypoint &p = a.keypoints[static_cast<std::size_t>(i)],
                   &q = b.keypoints[static_cast<std::size_t>(j)];
    const cv::Vec2d expected = map * cv::Vec3d(p.pixel.x(), p.pixel.y(), 1.0);
    const double error = std::hypot(expected[0] - q.pixel.x(), expected[1] - q.pixel.y());
    ++result.matches;
    if (error < 3.0 * std::pow(1.2, std::max(p.level, q.level))) ++result.right;
  }
  return result;
}

cv::Matx23d turn_and_scale(double degrees, double scale) {
  const cv::Mat m = cv::getRotationMatrix2D({(kWidth - 1) / 2.0F, (kHeight - 1) / 2.0F}, degrees, scale);
  return {m.at<double>(0, 0), m.at<double>(0, 1), m.at<double>(0, 2),
          m.at<double>(1, 0), m.at<double>(1, 1), m.at<double>(1, 2)};
}

TEST(OrbExtractor, FeaturesAreFoundAgainInATurnedImage) {
  const cv::Mat image = test::textured_image(kWidth, kHeight);
  for (const double degrees : {10.0, 45.0, 90.0, 170.0}) {
    const Agreement a = agreement(image, turn_and_scale(degrees, 1.0));
    // At 90 degrees a quarter of the picture is turned out of view.
    EXPECT_GT(a.matches, 100) << degrees;
    EXPECT_GT(a.right, 0.9 * a.matches) << degrees;
  }
}

TEST(OrbExtractor, FeaturesAreFoundAgainInAScaledImage) {
  const cv::Mat image = test::textured_image(kWidth, kHeight);
  for (const double scale : {0.6, 0.8, 1.3}) {
    const Agreement a = agreement(image, turn_and_scale(0.0, scale));
    EXPECT_GT(a.matches, 40) << scale;  // at 0.6 a third of the image is left to match

    EXPECT_GT(a.right, 0.9 * a.matches) << scale;
  }
}

TEST(OrbExtractor, UndistortedPixelsFollowTheCameraModel) {
  Camera camera = test::simple_camera(kWidth, kHeight);
  camera.k1 = 0.2;
  camera.k2 = -0.5;
  camera.p1 = 0.003;
  OrbExtractor extractor(small_options(), camera, DepthNoiseOptions{});
  const Features features = extractor.extract(test::textured_image(kWidth, kHeight), cv::Mat());
  ASSERT_GT(features.size(), 0U);
  for (const Keypoint& k : features.keypoints) {
    const Eigen::Vector2d back = camera.distort(k.undistorted.cast<double>());
    // Single precision of a coordinate of some hundred pixels.
    EXPECT_LT((back - k.pixel.cast<double>()).norm(), 1e-3);
  }
}

TEST(OrbExtractor, WithoutDepthKeypointsStayButCarryNone) {
  const cv::Mat image = test::textured_image(kWidth, kHeight);
  const Features none = extract(image, test::constant_depth(kWidth, kHeight, 0));
  const Features some = extract(image, test::constant_depth(kWidth, kHeight, 10000));
  ASSERT_EQ(none.size(), some.size());
  for (const Keypoint& k : none.keypoints) EXPECT_EQ(k.depth, 0.0F);
  for (const Keypoint& k : some.keypoints) EXPECT_FLOAT_EQ(k.depth, 2.0F);  // 10000 at 5000 a metre
}

}  // namespace
}  // namespace ipl_slam
