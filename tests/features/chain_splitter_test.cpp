#include "features/chain_splitter.hpp"

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

using Eigen::Vector2d;

// Appends points a pixel apart from one place to another, scattered across by up to `scatter`.
void draw(std::vector<EdgePoint>& chain, const Vector2d& from, const Vector2d& to, double scatter = 0.0) {
  std::mt19937 random(7);
  const Vector2d run = to - from, step = run.normalized(), across(-step.y(), step.x());
  for (double s = 0.0; s <= run.norm(); s += 1.0) {
    const double noise = (2.0 * static_cast<double>(random()) / 4294967295.0 - 1.0) * scatter;
    const Vector2d p = from + s * step + noise * across;
    chain.push_back({static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(step.x()),
                     static_cast<float>(step.y())});
  }
}

std::vector<StraightPiece> split(const std::vector<EdgePoint>& chain, double pixel = 1.0) {
  std::vector<StraightPiece> pieces;
  split_chain(chain, pixel, {}, pieces);
  return pieces;
}

TEST(ChainSplitter, a_corner_makes_two_pieces) {
  std::vector<EdgePoint> chain;
  draw(chain, {10, 20}, {80, 20});
  draw(chain, {80, 21}, {80, 60});
  const auto pieces = split(chain);
  ASSERT_EQ(pieces.size(), 2U);
  EXPECT_LT((pieces[0].start - Vector2d(10, 20)).norm(), 0.1);
  EXPECT_LT((pieces[0].end - Vector2d(80, 20)).norm(), 0.1);
  EXPECT_LT((pieces[1].start - Vector2d(80, 21)).norm(), 0.1);
  EXPECT_LT((pieces[1].end - Vector2d(80, 60)).norm(), 0.1);
}

TEST(ChainSplitter, fits_a_line_through_scattered_points) {
  std::vector<EdgePoint> chain;
  draw(chain, {10, 20}, {110, 70}, 0.5);
  const auto pieces = split(chain);
  ASSERT_EQ(pieces.size(), 1U);
  // 112 points of 0.3 px deviation: 0.06 px at the ends of the fitted line, and three times that at worst.
  const Vector2d across = Vector2d(-1, 2).normalized();
  EXPECT_NEAR(across.dot(pieces[0].start - Vector2d(10, 20)), 0.0, 0.18);
  EXPECT_NEAR(across.dot(pieces[0].end - Vector2d(10, 20)), 0.0, 0.18);
}

TEST(ChainSplitter, a_few_points_off_the_line_do_not_end_it) {
  std::vector<EdgePoint> chain;
  draw(chain, {10, 20}, {80, 20});
  for (const std::size_t i : {30U, 31U, 32U}) chain[i].v += 2.0F;
  chain[50].du = 0.0F, chain[50].dv = 1.0F;  // in place, but its edge runs across
  const auto pieces = split(chain);
  ASSERT_EQ(pieces.size(), 1U);
  EXPECT_NEAR(pieces[0].start.y(), 20.0, 1e-6);
  EXPECT_NEAR(pieces[0].end.y(), 20.0, 1e-6);
  for (std::size_t i = 30; i < 40; ++i) chain[i].v += 2.0F;
  EXPECT_EQ(split(chain).size(), 2U);
}

TEST(ChainSplitter, a_circle_gives_no_piece_longer_than_its_deviation_allows) {
  std::vector<EdgePoint> chain;
  constexpr double kRadius = 40.0;
  for (int i = 0; i < 251; ++i) {
    const double a = i / kRadius;
    chain.push_back({static_cast<float>(100 + kRadius * std::cos(a)),
                     static_cast<float>(100 + kRadius * std::sin(a)), static_cast<float>(-std::sin(a)),
                     static_cast<float>(std::cos(a))});
  }
  const auto pieces = split(chain);
  EXPECT_GE(pieces.size(), 4U);
  for (const StraightPiece& piece : pieces) {
    // A chord L of a circle bends by L^2 / 8R. The line may lie 0.7 px to either side and ends when points
    // are off by that: at most about twice the bend.
    EXPECT_LT((piece.end - piece.start).norm(), std::sqrt(8.0 * kRadius * 2.0 * 1.4));
  }
}

TEST(ChainSplitter, tolerances_grow_with_the_pixel) {
  std::vector<EdgePoint> chain;
  draw(chain, {10, 20}, {160, 20});
  for (std::size_t i = 0; i < chain.size(); ++i) chain[i].v += i % 2 == 0 ? 1.0F : -1.0F;
  EXPECT_TRUE(split(chain).empty());
  EXPECT_EQ(split(chain, 2.0).size(), 1U);
}

TEST(ChainSplitter, too_few_points_give_nothing) {
  std::vector<EdgePoint> chain;
  EXPECT_TRUE(split(chain).empty());
  draw(chain, {10, 20}, {15, 20});
  EXPECT_TRUE(split(chain).empty());
  // All in one place: no direction to speak of, and no harm.
  EXPECT_NO_THROW(split(std::vector<EdgePoint>(20, EdgePoint{5.0F, 5.0F, 1.0F, 0.0F})));
}

}  // namespace
}  // namespace ipl_slam
