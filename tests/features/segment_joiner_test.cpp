#include "features/segment_joiner.hpp"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

using Eigen::Vector2f;

LineSegment piece(const Vector2f& start, const Vector2f& end, int octave = 0) {
  LineSegment s;
  s.start = start;
  s.end = end;
  s.octave = octave;
  return s;
}

// Part of the line v = 100 + u / 2, from and to these u.
LineSegment part(float from, float to, int octave = 0, float offset = 0.0F) {
  return piece({from, 100.0F + 0.5F * from + offset}, {to, 100.0F + 0.5F * to + offset}, octave);
}

std::vector<LineSegment> join(const std::vector<LineSegment>& pieces) {
  return join_segments(pieces, {});
}

TEST(SegmentJoiner, joins_two_pieces_a_small_gap_apart) {
  const auto joined = join({part(10, 60), part(66, 120)});
  ASSERT_EQ(joined.size(), 1U);
  EXPECT_LT((joined[0].start - part(10, 120).start).norm(), 1e-3F);
  EXPECT_LT((joined[0].end - part(10, 120).end).norm(), 1e-3F);
}

TEST(SegmentJoiner, joins_a_chain_whatever_the_order_of_its_pieces) {
  std::vector<LineSegment> pieces{part(10, 50), part(56, 90), part(95, 140), part(145, 200), part(204, 230)};
  const auto first = join(pieces);
  ASSERT_EQ(first.size(), 1U);
  EXPECT_LT((first[0].start - part(10, 230).start).norm(), 1e-3F);
  EXPECT_LT((first[0].end - part(10, 230).end).norm(), 1e-3F);
  std::reverse(pieces.begin(), pieces.end());
  const auto second = join(pieces);
  ASSERT_EQ(second.size(), 1U);
  EXPECT_EQ(second[0].start, first[0].start);
  EXPECT_EQ(second[0].end, first[0].end);
}

TEST(SegmentJoiner, leaves_pieces_that_do_not_continue_one_another) {
  EXPECT_EQ(join({part(10, 60), part(100, 150)}).size(), 2U) << "far apart";
  EXPECT_EQ(join({part(10, 60), part(62, 72)}).size(), 1U);
  EXPECT_EQ(join({part(10, 60), part(66, 76)}).size(), 2U) << "a gap nearly as long as the shorter piece";
  EXPECT_EQ(join({part(10, 60), part(66, 120, 0, 4.0F)}).size(), 2U) << "beside the line";
  EXPECT_EQ(join({piece({10, 50}, {60, 50}), piece({64, 50}, {110, 56})}).size(), 2U) << "at an angle";
}

TEST(SegmentJoiner, edges_of_opposite_contrast_stay_apart) {
  const LineSegment forth = part(10, 120);
  EXPECT_EQ(join({forth, piece(forth.end, forth.start)}).size(), 2U);
}

TEST(SegmentJoiner, parallel_edges_of_the_same_side_stay_apart) {
  EXPECT_EQ(join({part(10, 120), part(10, 120, 0, 6.0F)}).size(), 2U);
}

TEST(SegmentJoiner, an_edge_found_on_two_octaves_is_one_and_keeps_the_place_of_the_finer) {
  const auto joined = join({part(10, 120), part(12, 150, 1, 1.0F)});
  ASSERT_EQ(joined.size(), 1U);
  EXPECT_EQ(joined[0].octave, 0);
  EXPECT_NEAR(joined[0].end.x(), 150.0F, 1.0F);
  const float middle = 0.5F * (joined[0].start.x() + joined[0].end.x());
  // The coarser piece has nearly a quarter of the weight.
  EXPECT_NEAR(0.5F * (joined[0].start.y() + joined[0].end.y()), 100.0F + 0.5F * middle, 0.3F);
}

TEST(SegmentJoiner, of_an_edge_found_twice_the_finer_stays) {
  // Too far apart for one line through both, too close for two edges on the coarser octave.
  const auto kept = join({part(10, 100), part(10, 120, 1, 3.5F)});
  ASSERT_EQ(kept.size(), 1U);
  EXPECT_EQ(kept[0].octave, 0);
  EXPECT_LT((kept[0].end - part(10, 100).end).norm(), 1e-3F);
  // As far apart at full size they are two.
  EXPECT_EQ(join({part(10, 100), part(10, 120, 0, 3.5F)}).size(), 2U);
  // The coarser one stays where the finer one covers less than half of it.
  EXPECT_EQ(join({part(10, 60), part(10, 120, 1, 3.5F)}).size(), 2U);
}

TEST(SegmentJoiner, gives_the_longest_first) {
  const auto joined = join({part(10, 40), piece({300, 10}, {300, 200}), piece({400, 100}, {500, 100})});
  ASSERT_EQ(joined.size(), 3U);
  EXPECT_FLOAT_EQ(joined[0].length(), 190.0F);
  EXPECT_FLOAT_EQ(joined[1].length(), 100.0F);
}

TEST(SegmentJoiner, nothing_and_points_do_no_harm) {
  EXPECT_TRUE(join({}).empty());
  const auto points = join({piece({5, 5}, {5, 5}), part(10, 60), piece({5, 5}, {5, 5})});
  ASSERT_GE(points.size(), 1U);
  EXPECT_LT((points[0].start - part(10, 60).start).norm(), 1e-3F);
  for (const LineSegment& s : points) EXPECT_TRUE(s.start.allFinite() && s.end.allFinite());
}

}  // namespace
}  // namespace ipl_slam
