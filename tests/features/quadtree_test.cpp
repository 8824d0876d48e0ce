#include "features/quadtree.hpp"

#include <algorithm>
#include <random>
#include <set>

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

std::vector<Corner> random_corners(int count, const cv::Rect& area, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::vector<Corner> corners;
  for (int i = 0; i < count; ++i) {
    const auto x =
        static_cast<std::int16_t>(area.x + static_cast<int>(random() % static_cast<unsigned>(area.width)));
    const auto y =
        static_cast<std::int16_t>(area.y + static_cast<int>(random() % static_cast<unsigned>(area.height)));
    corners.push_back({x, y, static_cast<std::uint8_t>(1 + random() % 250)});
  }
  return corners;
}

const cv::Rect kArea(16, 16, 300, 200);

TEST(SpreadEvenly, GivesExactlyTheQuotaInAscendingOrder) {
  const std::vector<Corner> corners = random_corners(2000, kArea);
  for (const double spread : {0.0, 0.3, 1.0}) {
    for (const int quota : {1, 2, 7, 100, 1999}) {
      const std::vector<int> chosen = spread_evenly(corners, kArea, quota, spread);
      EXPECT_EQ(static_cast<int>(chosen.size()), quota);
      EXPECT_TRUE(std::is_sorted(chosen.begin(), chosen.end()));
      EXPECT_EQ(std::set<int>(chosen.begin(), chosen.end()).size(), chosen.size());
    }
  }
}

TEST(SpreadEvenly, KeepsAllWhereThereAreFewerThanWanted) {
  const std::vector<Corner> corners = random_corners(30, kArea);
  EXPECT_EQ(spread_evenly(corners, kArea, 50, 0.5).size(), 30U);
  EXPECT_TRUE(spread_evenly({}, kArea, 50, 0.5).empty());
  EXPECT_TRUE(spread_evenly(corners, kArea, 0, 0.5).empty());
}

TEST(SpreadEvenly, WithoutSpreadTheStrongestAreTaken) {
  const std::vector<Corner> corners = random_corners(500, kArea);
  const std::vector<int> chosen = spread_evenly(corners, kArea, 50, 0.0);
  std::vector<int> scores;
  for (const Corner& c : corners) scores.push_back(c.score);
  std::sort(scores.rbegin(), scores.rend());
  for (const int i : chosen) EXPECT_GE(corners[static_cast<std::size_t>(i)].score, scores[49]);
}

TEST(SpreadEvenly, ALonelyWeakCornerIsKeptBesideACrowdOfStrongOnes) {
  std::vector<Corner> corners = random_corners(1000, cv::Rect(16, 16, 60, 60));
  corners.push_back({300, 200, 1});
  const std::vector<int> chosen = spread_evenly(corners, kArea, 50, 1.0);
  EXPECT_EQ(chosen.back(), 1000);
  EXPECT_EQ(spread_evenly(corners, kArea, 50, 0.0).back() == 1000, false);
}

TEST(SpreadEvenly, ManyCornersOnOnePixelDoNotSplitForEver) {
  const std::vector<Corner> corners(100, Corner{50, 50, 9});
  EXPECT_EQ(spread_evenly(corners, kArea, 20, 1.0).size(), 20U);
}

}  // namespace
}  // namespace ipl_slam
