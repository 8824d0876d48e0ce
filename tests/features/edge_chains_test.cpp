#include "features/edge_chains.hpp"

#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include <gtest/gtest.h>

#include "features/test_images.hpp"

namespace ipl_slam {
namespace {

EdgeChains chains_of(const cv::Mat& image, std::size_t min_points = 5) {
  EdgeMap map;
  compute_edge_map(image, 600, map);
  EdgeChains chains;
  EdgeChainFinder finder;
  finder.find(map, 400, min_points, chains);
  return chains;
}

cv::Mat bright_disc(double radius) {
  cv::Mat image(120, 160, CV_8UC1);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const double inside = radius - std::hypot(x - 80.0, y - 60.0);
      image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(40.0 + 75.0 * (1.0 + std::erf(inside)));
    }
  }
  return image;
}

TEST(EdgeChains, an_edge_is_one_chain_with_the_bright_side_on_its_right) {
  cv::Mat image(60, 80, CV_8UC1, cv::Scalar(50));
  image(cv::Rect(40, 0, 40, 60)) = 150;  // bright on the right in the image: the chain runs upwards
  const EdgeChains chains = chains_of(image);
  ASSERT_EQ(chains.begins.size(), 2U);
  EXPECT_EQ(chains.points.size(), 58U);  // all but the border
  for (std::size_t i = 1; i < chains.points.size(); ++i) {
    EXPECT_NEAR(chains.points[i].u, 39.5F, 0.01F);
    EXPECT_FLOAT_EQ(chains.points[i].v, chains.points[i - 1].v - 1.0F);
    EXPECT_LT(chains.points[i].dv, 0.0F);
    EXPECT_FLOAT_EQ(chains.points[i].du, 0.0F);
  }
}

TEST(EdgeChains, goes_once_round_a_disc_clockwise_on_its_outline) {
  constexpr double kRadius = 30.0;
  const EdgeChains chains = chains_of(bright_disc(kRadius));
  ASSERT_EQ(chains.begins.size(), 2U);
  double turned = 0.0;
  std::set<std::pair<long, long>> pixels;
  for (std::size_t i = 0; i < chains.points.size(); ++i) {
    const EdgePoint& p = chains.points[i];
    EXPECT_NEAR(std::hypot(p.u - 80.0, p.v - 60.0), kRadius, 0.25);
    if (i == 0) continue;
    const EdgePoint& q = chains.points[i - 1];
    EXPECT_LE(std::hypot(p.u - q.u, p.v - q.v), 2.5F);
    turned += std::remainder(std::atan2(p.v - 60.0, p.u - 80.0) - std::atan2(q.v - 60.0, q.u - 80.0),
                             2.0 * std::numbers::pi);
  }
  EXPECT_NEAR(turned, 2.0 * std::numbers::pi, 0.15);  // clockwise as seen, v points down
}

TEST(EdgeChains, short_chains_and_blank_images_give_none) {
  EXPECT_EQ(chains_of(bright_disc(30.0), 1000).begins.size(), 1U);
  EXPECT_TRUE(chains_of(bright_disc(30.0), 1000).points.empty());
  EXPECT_EQ(chains_of(cv::Mat(60, 80, CV_8UC1, cv::Scalar(90))).begins.size(), 1U);
}

TEST(EdgeChains, noise_stays_inside_the_image) {
  const EdgeChains chains = chains_of(test::noise_image(50, 37), 1);
  EXPECT_GT(chains.points.size(), 100U);
  for (const EdgePoint& p : chains.points) {
    EXPECT_TRUE(p.u >= 0.5F && p.v >= 0.5F && p.u <= 48.5F && p.v <= 35.5F);
  }
}

}  // namespace
}  // namespace ipl_slam
