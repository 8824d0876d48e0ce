#include "features/matcher.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <set>
#include <stdexcept>

#include <gtest/gtest.h>

#include "features/hamming.hpp"

namespace ipl_slam {
namespace {

Descriptor random_descriptor(std::mt19937& random) {
  Descriptor d;
  for (std::uint64_t& word : d) word = (static_cast<std::uint64_t>(random()) << 32) | random();
  return d;
}

Descriptor with_flipped_bits(Descriptor d, int count, int first = 0) {
  for (int i = first; i < first + count; ++i) d[static_cast<std::size_t>(i) / 64] ^= 1ULL << (i % 64);
  return d;
}

Features random_features(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  const auto unit = [&random] { return static_cast<float>(random()) / 4294967296.0F; };
  Features f;
  for (std::size_t i = 0; i < count; ++i) {
    Keypoint k;
    k.undistorted = {640.0F * unit(), 480.0F * unit()};
    k.pixel = k.undistorted;
    k.level = static_cast<int>(random() % 8);
    k.angle = 6.28F * unit();
    k.depth = random() % 4 == 0 ? 0.0F : 1.0F + 4.0F * unit();
    f.keypoints.push_back(k);
    f.descriptors.push_back(random_descriptor(random));
  }
  return f;
}

// A second view of `a`: the same features with some bits flipped, in another order.
Features disturbed(const Features& a, unsigned seed) {
  std::mt19937 random(seed);
  Features b;
  for (std::size_t i = a.size(); i-- > 0;) {
    b.keypoints.push_back(a.keypoints[i]);
    b.descriptors.push_back(with_flipped_bits(a.descriptors[i], static_cast<int>(random() % 90),
                                              static_cast<int>(random() % 160)));
  }
  return b;
}

TEST(FeatureGrid, FindsWhatATryOfAllKeypointsFinds) {
  const Features features = random_features(800, 3);
  const FeatureGrid grid(features);
  std::mt19937 random(4);
  std::size_t total = 0;
  for (int i = 0; i < 300; ++i) {
    // Windows of all sizes, some partly or wholly outside.
    const float u = static_cast<float>(random() % 900) - 130.0F,
                v = static_cast<float>(random() % 700) - 110.0F;
    const float radius = static_cast<float>(random() % 120);
    const int low = static_cast<int>(random() % 8), high = static_cast<int>(random() % 8);
    std::multiset<int> expected, found;
    for (std::size_t k = 0; k < features.size(); ++k) {
      const Keypoint& p = features.keypoints[k];
      const float du = p.undistorted.x() - u, dv = p.undistorted.y() - v;
      if (du * du + dv * dv <= radius * radius && p.level >= low && p.level <= high) {
        expected.insert(static_cast<int>(k));
      }
    }
    grid.for_each_in_radius(u, v, radius, low, high, [&found](int k) { found.insert(k); });
    EXPECT_EQ(found, expected);
    total += expected.size();
  }
  EXPECT_GT(total, 1000U);
}

TEST(FeatureGrid, IsDefinedForNoKeypointsAndForSenselessWindows) {
  int calls = 0;
  const auto count = [&calls](int) { ++calls; };
  FeatureGrid(Features{}).for_each_in_radius(10, 10, 100, 0, 7, count);
  const FeatureGrid grid(random_features(50, 5));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  grid.for_each_in_radius(nan, 10, 100, 0, 7, count);
  grid.for_each_in_radius(10, 10, nan, 0, 7, count);
  grid.for_each_in_radius(10, 10, -1, 0, 7, count);
  grid.for_each_in_radius(1e30F, -1e30F, 100, 0, 7, count);
  EXPECT_EQ(calls, 0);
  grid.for_each_in_radius(320, 240, 1e9F, 0, 7, count);
  EXPECT_EQ(calls, 50);
  EXPECT_THROW(FeatureGrid(Features{}, 0.0F), std::invalid_argument);
}

TEST(TwoNearest, VectorAndPortableCodeAgreeWithASlowSearch) {
  // Sizes around the group of eight; repeated descriptors make ties.
  for (const std::size_t count : {0U, 1U, 7U, 8U, 9U, 100U}) {
    Features a = random_features(40, 1), b = random_features(count, 2);
    for (std::size_t i = 0; i + 3 < count; i += 3)
      b.descriptors[i] = b.descriptors[i + 3] = a.descriptors[i % 40];
    const TwoNearest portable = two_nearest(a.descriptors, b.descriptors, Simd::portable);
    const TwoNearest best = two_nearest(a.descriptors, b.descriptors, best_simd());
    for (const auto& [from, to, fast, slow] :
         {std::tuple(&a, &b, &best.in_b, &portable.in_b), std::tuple(&b, &a, &best.in_a, &portable.in_a)}) {
      ASSERT_EQ(fast->size(), from->size());
      for (std::size_t i = 0; i < from->size(); ++i) {
        Nearest expected;
        for (std::size_t j = 0; j < to->size(); ++j) {
          const int d = hamming_distance(from->descriptors[i], to->descriptors[j]);
          if (d < expected.distance) {
            expected.second_distance = expected.distance;
            expected.distance = d;
            expected.index = static_cast<int>(j);
          } else {
            expected.second_distance = std::min(expected.second_distance, d);
          }
        }
        for (const Nearest& n : {(*fast)[i], (*slow)[i]}) {
          EXPECT_EQ(n.index, expected.index);
          EXPECT_EQ(n.distance, expected.distance);
          EXPECT_EQ(n.second_distance, expected.second_distance);
        }
      }
    }
  }
}

TEST(TwoNearest, CountsAllBitsOfOppositeDescriptors) {
  const std::vector<Descriptor> zeros(9, Descriptor{}), ones(9, with_flipped_bits(Descriptor{}, 256));
  for (const Nearest& n : two_nearest(zeros, ones).in_b) EXPECT_EQ(n.distance, 256);
}

TEST(MatchBruteForce, FindsTheDisturbedCopiesAndNothingElse) {
  const Features a = random_features(300, 6), b = disturbed(a, 7);
  MatchOptions options;
  const auto pairs = match_brute_force(a, b, options);
  ASSERT_GT(pairs.size(),
            200U);  // up to 89 of 256 bits were flipped; 80 pass, where the runner-up is far enough
  for (const auto& [i, j] : pairs) EXPECT_EQ(i + j, 299);
  EXPECT_EQ(pairs, match_brute_force(a, b, options, Simd::portable));
}

TEST(MatchBruteForce, AnAmbiguousDescriptorMatchesNothing) {
  Features a = random_features(1, 8), b;
  for (const int bits : {10, 11}) {
    b.keypoints.push_back(a.keypoints[0]);
    b.descriptors.push_back(with_flipped_bits(a.descriptors[0], bits));
  }
  MatchOptions options;
  EXPECT_TRUE(match_brute_force(a, b, options).empty());
  options.ratio = 1.0;
  EXPECT_EQ(match_brute_force(a, b, options).size(), 1U);
}

TEST(MatchBruteForce, DropsPairsThatTurnOtherwiseThanMost) {
  const Features a = random_features(100, 9);
  Features b = a;
  for (std::size_t i = 0; i < b.size(); ++i) {
    // All turn by -0.1 rad, across the wrap of the angle; every tenth by 2 rad more.
    b.keypoints[i].angle =
        std::fmod(a.keypoints[i].angle + 6.1832F + (i % 10 == 0 ? 2.0F : 0.0F), 6.2831853F);
  }
  MatchOptions options;
  const auto pairs = match_brute_force(a, b, options);
  EXPECT_EQ(pairs.size(), 90U);
  for (const auto& [i, j] : pairs) EXPECT_NE(i % 10, 0);
  options.max_rotation = 0.0;
  EXPECT_EQ(match_brute_force(a, b, options).size(), 100U);
}

TEST(MatchBruteForce, EmptySidesGiveNoMatches) {
  const Features some = random_features(10, 1);
  EXPECT_TRUE(match_brute_force(some, {}, {}).empty());
  EXPECT_TRUE(match_brute_force({}, some, {}).empty());
  EXPECT_TRUE(match_brute_force({}, {}, {}).empty());
}

// The rule of match_projected, written down slowly: all keypoints, all checks, then one-to-one.
std::vector<int> slow_match(const Features& f, const std::vector<ProjectedPoint>& points,
                            const MatchOptions& o, const std::vector<std::uint8_t>& taken) {
  std::vector<std::pair<int, int>> choice;  // distance, keypoint
  for (const ProjectedPoint& p : points) {
    std::vector<std::pair<int, int>> found;
    for (std::size_t k = 0; k < f.size(); ++k) {
      const Keypoint& q = f.keypoints[k];
      const double turn = std::abs(std::remainder(q.angle - p.angle, 2.0 * std::numbers::pi));
      if ((q.undistorted - p.uv).norm() > p.radius || q.level < p.min_level || q.level > p.max_level)
        continue;
      if (taken[k] != 0 || (p.angle >= 0 && turn > o.max_rotation)) continue;
      if (p.depth > 0 && q.depth > 0 && std::abs(1 / q.depth - 1 / p.depth) > o.inverse_depth_gate) continue;
      found.emplace_back(hamming_distance(*p.descriptor, f.descriptors[k]), static_cast<int>(k));
    }
    std::sort(found.begin(), found.end());
    bool good = !found.empty() && found[0].first <= o.max_distance;
    if (good && found.size() > 1) {
      bool same_level = false;  // of any runner-up at the second best distance
      for (std::size_t i = 1; i < found.size() && found[i].first == found[1].first; ++i) {
        same_level |= f.keypoints[static_cast<std::size_t>(found[i].second)].level ==
                      f.keypoints[static_cast<std::size_t>(found[0].second)].level;
      }
      if (same_level && found[0].first >= o.ratio * found[1].first) good = false;
    }
    choice.push_back(good ? found[0] : std::pair(0, -1));
  }
  std::vector<int> result(points.size(), -1);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (choice[i].second < 0) continue;
    bool wins = true;
    for (std::size_t j = 0; j < points.size(); ++j) {
      if (j == i || choice[j].second != choice[i].second) continue;
      wins &= std::pair(choice[i].first, i) < std::pair(choice[j].first, j);
    }
    if (wins) result[i] = choice[i].second;
  }
  return result;
}

TEST(MatchProjected, AgreesWithTheRuleWrittenDownSlowlyAndIsOneToOne) {
  const Features features = random_features(600, 10);
  const FeatureGrid grid(features);
  std::mt19937 random(11);
  std::vector<Descriptor> descriptors(500);
  std::vector<ProjectedPoint> points(500);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto source = static_cast<std::size_t>(random() % 600);
    const Keypoint& k = features.keypoints[source];
    descriptors[i] = with_flipped_bits(features.descriptors[source], static_cast<int>(random() % 110));
    ProjectedPoint& p = points[i];
    p.uv = k.undistorted + Eigen::Vector2f(static_cast<float>(random() % 20) - 10.0F, 3.0F);
    p.radius = 5.0F + static_cast<float>(random() % 60);
    p.min_level = std::max(0, k.level - 1);
    p.max_level = k.level + 1;
    p.depth = i % 3 == 0 ? 0.0F : k.depth + (i % 5 == 0 ? 1.5F : 0.02F);
    p.angle = i % 4 == 0 ? -1.0F : std::fmod(k.angle + static_cast<float>(random() % 8) / 10.0F, 6.28F);
    p.descriptor = &descriptors[i];
  }
  std::vector<std::uint8_t> taken(600, 0);
  for (std::size_t k = 0; k < taken.size(); k += 11) taken[k] = 1;
  MatchOptions options;
  for (const double ratio : {0.7, 1.0}) {
    for (const int max_distance : {50, 128}) {
      options.ratio = ratio;
      options.max_distance = max_distance;
      const std::vector<int> found = match_projected(features, grid, points, options, taken);
      EXPECT_EQ(found, slow_match(features, points, options, taken));
      std::set<int> used;
      for (const int k : found) {
        if (k < 0) continue;
        EXPECT_TRUE(used.insert(k).second);
      }
      EXPECT_GT(used.size(), 100U);
    }
  }
}

// One keypoint at (100, 100), level 2, 2 m, angle 0.1, and a point that fits it.
class MatchProjectedTest : public ::testing::Test {
 protected:
  MatchProjectedTest() {
    Keypoint k;
    k.undistorted = {100.0F, 100.0F};
    k.level = 2;
    k.depth = 2.0F;
    k.angle = 0.1F;
    add(k, Descriptor{});
    point.uv = {102.0F, 100.0F};
    point.radius = 5.0F;
    point.min_level = 1;
    point.max_level = 3;
    point.depth = 2.1F;
    point.angle = 6.2F;  // 0.18 rad away, across the wrap
    point.descriptor = &descriptor;
  }
  void add(const Keypoint& k, const Descriptor& d) {
    features.keypoints.push_back(k);
    features.descriptors.push_back(d);
  }
  [[nodiscard]] int match(std::vector<std::uint8_t> taken = {}) const {
    return match_projected(features, FeatureGrid(features), std::vector{point}, options, taken)[0];
  }

  Features features;
  Descriptor descriptor = with_flipped_bits(Descriptor{}, 20);
  ProjectedPoint point;
  MatchOptions options;
};

TEST_F(MatchProjectedTest, AcceptsTheKeypointThatFits) {
  EXPECT_EQ(match(), 0);
}

TEST_F(MatchProjectedTest, RefusesAnotherPlaceLevelTurnOrDepth) {
  const ProjectedPoint fitting = point;
  point.uv = {106.0F, 100.0F};
  EXPECT_EQ(match(), -1);
  point = fitting;
  point.max_level = 1;
  EXPECT_EQ(match(), -1);
  point = fitting;
  point.angle = 1.0F;
  EXPECT_EQ(match(), -1);
  point = fitting;
  point.depth = 4.0F;
  EXPECT_EQ(match(), -1);
  point.depth = 0.0F;
  EXPECT_EQ(match(), 0);
}

TEST_F(MatchProjectedTest, AKeypointWithoutDepthPassesTheDepthGate) {
  point.depth = 4.0F;
  features.keypoints[0].depth = 0.0F;
  EXPECT_EQ(match(), 0);
}

TEST_F(MatchProjectedTest, RefusesTooDistantDescriptorsAndTakenKeypoints) {
  EXPECT_EQ(match({1}), -1);
  options.max_distance = 19;
  EXPECT_EQ(match(), -1);
}

TEST_F(MatchProjectedTest, ASimilarKeypointOnTheSameLevelIsAmbiguousOnANeighbouringOneNot) {
  Keypoint twin = features.keypoints[0];
  add(twin, with_flipped_bits(Descriptor{}, 2, 100));  // 22 bits from the point, against 20
  EXPECT_EQ(match(), -1);
  features.keypoints[1].level = 3;
  EXPECT_EQ(match(), 0);
}

TEST_F(MatchProjectedTest, RefusesATakenListOfTheWrongLength) {
  EXPECT_THROW(static_cast<void>(match({0, 0})), std::invalid_argument);
}

}  // namespace
}  // namespace ipl_slam
