#include "features/line_matcher.hpp"

#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

#include "common/random.hpp"
#include "features/line_motion.hpp"
#include "features/segment_gate.hpp"

namespace ipl_slam {
namespace {

LineSegment segment(Eigen::Vector2f start, Eigen::Vector2f end) {
  LineSegment s;
  s.start = s.start_pixel = start;
  s.end = s.end_pixel = end;
  return s;
}

Descriptor random_descriptor(Random& random) {
  return {random.bits(), random.bits(), random.bits(), random.bits()};
}

Descriptor with_flipped_bits(Descriptor d, int count) {
  for (int i = 0; i < count; ++i) d[static_cast<std::size_t>(i) % 4] ^= 1ULL << (i / 4 * 7 % 64);
  return d;
}

LineFeatures random_lines(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  LineFeatures lines;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector2f start(static_cast<float>(random.uniform(0.0, 640.0)),
                                static_cast<float>(random.uniform(0.0, 480.0)));
    const double angle = random.uniform(-3.1, 3.1), length = random.uniform(25.0, 150.0);
    const Eigen::Vector2f way(static_cast<float>(length * std::cos(angle)),
                              static_cast<float>(length * std::sin(angle)));
    lines.segments.push_back(segment(start, start + way));
    lines.descriptors.push_back(random_descriptor(random));
  }
  return lines;
}

// Turned about the middle of the image and shifted, with a few bits flipped, in opposite order.
LineFeatures moved(const LineFeatures& a, double turn, const Eigen::Vector2d& shift) {
  ImageMotion motion;
  motion.A << std::cos(turn), -std::sin(turn), std::sin(turn), std::cos(turn);
  const Eigen::Vector2d middle(320.0, 240.0);
  motion.t = middle - motion.A * middle + shift;
  LineFeatures b;
  for (std::size_t i = a.size(); i-- > 0;) {
    b.segments.push_back(segment(motion * a.segments[i].start, motion * a.segments[i].end));
    b.descriptors.push_back(with_flipped_bits(a.descriptors[i], 20));
  }
  return b;
}

TEST(SegmentTable, FindsTheSameWithAndWithoutWideInstructions) {
  if (best_simd() == Simd::portable) GTEST_SKIP() << "needs a processor with AVX2";
  const LineFeatures a = random_lines(203, 1), b = random_lines(301, 2);  // not whole groups of eight
  const SegmentTable table(b.segments);
  const SegmentGate gate{.radius = 80.0F, .min_cosine = 0.8F, .min_overlap = 0.1F, .along = 20.0F};
  std::size_t total = 0;
  for (const LineSegment& s : a.segments) {
    std::vector<int> wide, portable;
    table.find(s.start, s.end, gate, Simd::avx2, wide);
    table.find(s.start, s.end, gate, Simd::portable, portable);
    EXPECT_EQ(wide, portable);
    total += wide.size();
  }
  EXPECT_GT(total, 100U);
}

// One expected line, and a segment that passes or fails by one of the gates.
struct GateCase {
  const char* name;
  Eigen::Vector2f start, end;
  bool passes;
};

class SegmentGates : public ::testing::TestWithParam<GateCase> {};

TEST_P(SegmentGates, PassWhatFits) {
  const GateCase& c = GetParam();
  const std::vector<LineSegment> segments(9, segment(c.start, c.end));
  const SegmentGate gate{
      .radius = 5.0F, .min_cosine = 0.95F, .min_overlap = 0.5F, .along = 0.0F, .max_length_ratio = 4.0F};
  for (const Simd simd : {Simd::portable, best_simd()}) {
    std::vector<int> found;
    SegmentTable(segments).find({100.0F, 100.0F}, {200.0F, 100.0F}, gate, simd, found);
    EXPECT_EQ(found.size(), c.passes ? 9U : 0U);
  }
}

INSTANTIATE_TEST_SUITE_P(One, SegmentGates,
                         ::testing::Values(GateCase{"itself", {100, 100}, {200, 100}, true},
                                           GateCase{"beside", {100, 104}, {200, 104}, true},
                                           GateCase{"too_far_beside", {100, 106}, {200, 106}, false},
                                           GateCase{"one_end_too_far", {100, 100}, {200, 106}, false},
                                           GateCase{"other_way_round", {200, 100}, {100, 100}, false},
                                           GateCase{"piece", {120, 100}, {150, 100}, true},
                                           GateCase{"too_short_a_piece", {120, 100}, {144, 100}, false},
                                           GateCase{"half_beyond_the_end", {150, 100}, {250, 100}, true},
                                           GateCase{"mostly_beyond_the_end", {151, 100}, {251, 100}, false},
                                           GateCase{"steep", {150, 96}, {153, 104}, false},
                                           GateCase{"no_length", {150, 100}, {150, 100}, false}),
                         [](const auto& c) { return std::string(c.param.name); });

TEST(SegmentTable, FindsNothingForALineOfNoLength) {
  const SegmentTable table(random_lines(20, 1).segments);
  std::vector<int> found;
  table.find({100.0F, 100.0F}, {100.0F, 100.0F}, {.radius = 1e6F, .min_cosine = 1e-6F}, best_simd(), found);
  EXPECT_TRUE(found.empty());
}

TEST(CommonMotion, IsFoundAmongWrongPairs) {
  const LineFeatures a = random_lines(60, 5), b = moved(a, 0.2, {30.0, -20.0});
  std::vector<std::pair<int, int>> pairs;
  for (int i = 0; i < 60; ++i) pairs.emplace_back(i, i % 3 == 0 ? (i * 7) % 60 : 59 - i);
  const ImageMotion motion = common_motion(a.segments, b.segments, pairs, 5.0);
  for (std::size_t i = 0; i < 60; ++i) {
    // Two thirds of the pairs are exact; the prior towards no motion pulls by less than a pixel.
    EXPECT_LT((motion * a.segments[i].start - b.segments[59 - i].start).norm(), 1.0F);
  }
}

TEST(CommonMotion, OfParallelLinesIsAcrossThem) {
  std::vector<LineSegment> a, b;
  for (int i = 0; i < 5; ++i) {
    const auto v = 60.0F * static_cast<float>(i);
    a.push_back(segment({100.0F, v}, {300.0F, v}));
    b.push_back(segment({100.0F, v + 12.0F}, {300.0F, v + 12.0F}));
  }
  const std::vector<std::pair<int, int>> pairs = {{0, 0}, {1, 1}, {2, 2}, {3, 3}, {4, 4}};
  const Eigen::Vector2f moved_point = common_motion(a, b, pairs, 5.0) * Eigen::Vector2f(200.0F, 120.0F);
  EXPECT_NEAR(moved_point.x(), 200.0F, 1e-3F);
  EXPECT_NEAR(moved_point.y(), 132.0F, 0.1F);
}

TEST(CommonMotion, IsNoneForFewerThanTwoPairs) {
  const LineFeatures a = random_lines(2, 1);
  const ImageMotion motion = common_motion(a.segments, a.segments, {}, 5.0);
  EXPECT_EQ(motion.A, Eigen::Matrix2d::Identity());
  EXPECT_EQ(motion.t, Eigen::Vector2d::Zero());
}

TEST(MatchLines, FindsAllLinesOfAMovedImage) {
  const LineFeatures a = random_lines(120, 3), b = moved(a, 0.25, {40.0, 25.0});
  const auto pairs = match_lines(a, b, {});
  ASSERT_EQ(pairs.size(), 120U);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    EXPECT_EQ(pairs[i], std::pair(static_cast<int>(i), 119 - static_cast<int>(i)));
  }
}

TEST(MatchLines, IsTheSameWithAndWithoutWideInstructions) {
  const LineFeatures a = random_lines(203, 3), b = moved(a, 0.1, {40.0, 25.0});
  EXPECT_EQ(match_lines(a, b, {}, Simd::portable), match_lines(a, b, {}, best_simd()));
}

TEST(MatchLines, LeavesOutWhatMovesAgainstTheOthersTooFar) {
  const LineFeatures a = random_lines(60, 3);
  LineFeatures b = moved(a, 0.0, {10.0, 0.0});
  LineSegment& stray = b.segments[59 - 7];
  const Eigen::Vector2f across(-(stray.end - stray.start).y(), (stray.end - stray.start).x());
  stray = segment(stray.start + 60.0F * across.normalized(), stray.end + 60.0F * across.normalized());
  const auto pairs = match_lines(a, b, {});
  EXPECT_EQ(pairs.size(), 59U);
  for (const auto& [i, j] : pairs) EXPECT_NE(i, 7);
}

TEST(MatchLines, LeavesOutWhatHasTwoLikelyPartners) {
  const LineFeatures a = random_lines(30, 3);
  LineFeatures b = moved(a, 0.0, {5.0, 0.0});
  const LineSegment& first = b.segments[0];
  const Eigen::Vector2f across(-(first.end - first.start).y(), (first.end - first.start).x());
  b.segments.push_back(
      segment(first.start + 12.0F * across.normalized(), first.end + 12.0F * across.normalized()));
  b.descriptors.push_back(b.descriptors[0]);
  EXPECT_EQ(match_lines(a, b, {}).size(), 29U);
}

TEST(MatchLines, TakesTheBestPieceOfABrokenLine) {
  const LineFeatures a = random_lines(30, 3);
  LineFeatures b = moved(a, 0.0, {5.0, 0.0});
  const LineSegment whole = b.segments[0];
  b.segments[0] = segment(whole.start, 0.6F * whole.end + 0.4F * whole.start);
  b.segments.push_back(segment(0.65F * whole.end + 0.35F * whole.start, whole.end));
  b.descriptors.push_back(with_flipped_bits(a.descriptors[29], 23));  // nearly as close as the first piece
  const auto pairs = match_lines(a, b, {});
  ASSERT_EQ(pairs.size(), 30U);
  EXPECT_EQ(pairs.back(), std::pair(29, 0));
}

TEST(MatchLines, OfNothingIsNothing) {
  const LineFeatures some = random_lines(5, 1);
  EXPECT_TRUE(match_lines({}, some, {}).empty());
  EXPECT_TRUE(match_lines(some, {}, {}).empty());
}

TEST(MatchLines, RefusesLinesWithoutDescriptors) {
  LineFeatures lines = random_lines(5, 1);
  lines.descriptors.pop_back();
  EXPECT_THROW(static_cast<void>(match_lines(lines, lines, {})), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(match_projected_lines(lines, {}, {})), std::invalid_argument);
}

ProjectedSegment expected(const LineFeatures& lines, std::size_t index, float radius = 5.0F) {
  return {lines.segments[index].start, lines.segments[index].end, &lines.descriptors[index], radius};
}

TEST(MatchProjectedLines, FindsWhatIsWhereItIsExpected) {
  const LineFeatures a = random_lines(100, 8), b = moved(a, 0.01, {1.0, -1.0});
  std::vector<ProjectedSegment> projected;
  for (std::size_t i = 0; i < a.size(); ++i) projected.push_back(expected(a, i, 8.0F));
  const std::vector<int> matches = match_projected_lines(b, projected, {});
  ASSERT_EQ(matches.size(), a.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(matches[i], 99 - static_cast<int>(i));
  EXPECT_EQ(match_projected_lines(b, projected, {}, Simd::portable), matches);
}

TEST(MatchProjectedLines, LeavesOutWhatLooksDifferentOrLiesElsewhere) {
  const LineFeatures lines = random_lines(3, 8);
  const Descriptor other = with_flipped_bits(lines.descriptors[0], 120);
  ProjectedSegment unlike = expected(lines, 0), away = expected(lines, 1);
  unlike.descriptor = &other;
  away.start.array() += 100.0F, away.end.array() += 100.0F;
  const std::vector<ProjectedSegment> projected = {unlike, away, expected(lines, 2)};
  EXPECT_EQ(match_projected_lines(lines, projected, {}), (std::vector<int>{-1, -1, 2}));
}

TEST(MatchProjectedLines, GivesASegmentToTheCloserOfTwoLandmarks) {
  const LineFeatures lines = random_lines(1, 8);
  const Descriptor farther = with_flipped_bits(lines.descriptors[0], 30);
  const Descriptor closer = with_flipped_bits(lines.descriptors[0], 10);
  std::vector<ProjectedSegment> projected(3, expected(lines, 0));
  projected[0].descriptor = &farther, projected[1].descriptor = projected[2].descriptor = &closer;
  EXPECT_EQ(match_projected_lines(lines, projected, {}), (std::vector<int>{-1, 0, -1}));
}

TEST(MatchProjectedLines, TakesTheBestPieceOfABrokenLine) {
  Random random(3);
  const Descriptor descriptor = random_descriptor(random);
  LineFeatures lines;
  lines.segments = {segment({100.0F, 100.0F}, {140.0F, 100.5F}), segment({145.0F, 101.0F}, {200.0F, 101.5F})};
  lines.descriptors = {with_flipped_bits(descriptor, 20), with_flipped_bits(descriptor, 19)};
  const std::vector<ProjectedSegment> projected = {{{100.0F, 100.0F}, {200.0F, 101.0F}, &descriptor, 5.0F}};
  EXPECT_EQ(match_projected_lines(lines, projected, {}), std::vector<int>{1});
}

}  // namespace
}  // namespace ipl_slam
