#include "pipeline/instance_overlay.hpp"

#include <memory>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace ipl_slam {
namespace {

const cv::Size kSize(200, 150);

TrackedInstance square(cv::Rect where) {
  cv::Mat image = cv::Mat::zeros(kSize, CV_8UC1);
  image(where) = 255;
  return {InstanceId{3}, {"person", 0.9F, where, BitMask::from_image(image)}, 0};
}

// Blue, green and red at a pixel inside the mask, well away from outline and label.
cv::Vec3b tinted(MotionState state) {
  const cv::Mat grey(kSize, CV_8UC3, cv::Scalar(100, 100, 100));
  const cv::Mat picture = draw_instances(grey, {square({60, 60, 80, 60})}, [&](InstanceId id) {
    return ContourVerdict{id, state, {}};
  });
  return picture.at<cv::Vec3b>(90, 100);
}

TEST(InstanceOverlay, TellsTheStatesByColour) {
  const cv::Vec3b moving = tinted(MotionState::kMoving);
  EXPECT_GT(moving[2], moving[1]);
  EXPECT_GT(moving[2], 100);
  const cv::Vec3b still = tinted(MotionState::kStill);
  EXPECT_GT(still[1], still[2]);
  EXPECT_GT(still[1], 100);
  const cv::Vec3b candidate = tinted(MotionState::kCandidate);
  EXPECT_GT(candidate[1], candidate[0]);
  EXPECT_GT(candidate[2], candidate[0]);
}

TEST(InstanceOverlay, LeavesThePictureAloneWhereNobodyIs) {
  cv::Mat image(kSize, CV_8UC3, cv::Scalar(10, 20, 30));
  const cv::Mat picture = draw_instances(image, {square({60, 80, 20, 20})});
  EXPECT_EQ(picture.at<cv::Vec3b>(5, 5), cv::Vec3b(10, 20, 30));
  EXPECT_EQ(picture.at<cv::Vec3b>(140, 190), cv::Vec3b(10, 20, 30));
  EXPECT_EQ(cv::countNonZero(image.reshape(1) != cv::Mat(kSize, CV_8UC3, cv::Scalar(10, 20, 30)).reshape(1)),
            0)
      << "the frame itself must not be drawn on";
}

TEST(InstanceOverlay, TakesGreyPicturesAndMasksAtTheBorder) {
  const cv::Mat grey(kSize, CV_8UC1, cv::Scalar(50));
  const cv::Mat picture = draw_instances(grey, {square({0, 0, 30, 150}), square({190, 140, 10, 10})});
  EXPECT_EQ(picture.type(), CV_8UC3);
  EXPECT_EQ(picture.size(), kSize);
}

TEST(InstanceOverlay, OutlinesRegionsWhoseFeaturesAreRemovedInRedAndWhite) {
  const cv::Rect grown(50, 50, 100, 80);
  const cv::Mat grey(kSize, CV_8UC3, cv::Scalar(100, 100, 100));
  const auto drawn = [&](bool dynamic) {
    FeatureWeights weights;
    weights.regions = std::make_shared<const std::vector<Region>>(
        std::vector<Region>{{InstanceId{3}, square(grown).instance.mask, {.dynamic = dynamic}}});
    return draw_instances(grey, {square({60, 60, 80, 60})}, {}, weights);
  };
  const cv::Mat with = drawn(true), without = drawn(false);
  const cv::Mat plain = draw_instances(grey, {square({60, 60, 80, 60})});
  EXPECT_EQ(cv::norm(without, plain, cv::NORM_INF), 0.0) << "features on it stay";
  int red = 0, white = 0;
  for (int x = grown.x + 4; x < grown.x + grown.width - 4; ++x) {
    const cv::Vec3b c = with.at<cv::Vec3b>(grown.y + grown.height - 1, x);
    red += c[2] > 200 && c[1] < 100 ? 1 : 0;
    white += c[2] > 200 && c[1] > 200 ? 1 : 0;
  }
  EXPECT_EQ(red + white, grown.width - 8) << "no gap along its lower edge";
  EXPECT_GT(red, 30);
  EXPECT_GT(white, 30);
  EXPECT_EQ(with.at<cv::Vec3b>(90, 100), plain.at<cv::Vec3b>(90, 100)) << "inside";
}

}  // namespace
}  // namespace ipl_slam
