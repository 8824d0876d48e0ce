#include "features/edge_map.hpp"

#include <stdexcept>

#include <gtest/gtest.h>

#include "features/test_images.hpp"

namespace ipl_slam {
namespace {

TEST(EdgeMap, a_ramp_has_its_slope_everywhere_but_at_the_border) {
  cv::Mat ramp(24, 40, CV_8UC1);
  for (int y = 0; y < ramp.rows; ++y) {
    for (int x = 0; x < ramp.cols; ++x)
      ramp.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(4 * x + 3 * y);
  }
  EdgeMap map;
  compute_edge_map(ramp, 1, map);
  for (int y = 4; y < ramp.rows - 4; ++y) {
    for (int x = 4; x < ramp.cols - 4; ++x) {
      const auto i = static_cast<std::size_t>(y * ramp.cols + x);
      ASSERT_EQ(map.gx[i], 4 * kEdgeGradientUnit);
      ASSERT_EQ(map.gy[i], 3 * kEdgeGradientUnit);
      ASSERT_EQ(map.magnitude[i], 7 * kEdgeGradientUnit);
      ASSERT_FALSE(map.runs_along_u(i));
      ASSERT_EQ(map.is_ridge[i], 0);
    }
  }
  EXPECT_EQ(map.magnitude[0], 0);
  EXPECT_EQ(map.magnitude[static_cast<std::size_t>(ramp.cols) * 10], 0);
}

TEST(EdgeMap, the_strongest_step_there_is_does_not_overflow) {
  cv::Mat image(32, 32, CV_8UC1, cv::Scalar(0));
  image(cv::Rect(16, 0, 16, 32)) = 255;
  image(cv::Rect(0, 16, 32, 16)) = 255;  // and a corner, where both gradients are large
  EdgeMap map;
  compute_edge_map(image, 1, map);
  int ridges = 0;
  for (std::size_t i = 0; i < map.magnitude.size(); ++i) {
    ASSERT_GE(map.magnitude[i], 0);
    ASSERT_GE(map.gx[i], 0);
    ASSERT_GE(map.gy[i], 0);
    ridges += map.is_ridge[i];
  }
  EXPECT_NEAR(ridges, 30, 6);  // one pixel across each edge
}

TEST(EdgeMap, nothing_of_an_earlier_image_is_left) {
  EdgeMap used, fresh;
  compute_edge_map(test::noise_image(50, 40), 1, used);
  const cv::Mat image = test::textured_image(50, 40);
  compute_edge_map(image, 100, used);
  compute_edge_map(image, 100, fresh);
  EXPECT_EQ(used.magnitude, fresh.magnitude);
  EXPECT_EQ(used.is_ridge, fresh.is_ridge);
  compute_edge_map(test::textured_image(40, 50), 100, used);
  EXPECT_EQ(used.width, 40);
  EXPECT_EQ(used.magnitude.size(), 2000U);
}

TEST(EdgeMap, refuses_what_is_no_grey_image) {
  EdgeMap map;
  EXPECT_THROW(compute_edge_map(cv::Mat(20, 20, CV_8UC3), 1, map), std::invalid_argument);
  EXPECT_THROW(compute_edge_map(cv::Mat(2, 20, CV_8UC1), 1, map), std::invalid_argument);
}

}  // namespace
}  // namespace ipl_slam
