#include "loop/place_index.hpp"

#include <stdexcept>

#include <gtest/gtest.h>

#include "common/random.hpp"

namespace ipl_slam {
namespace {

using Place = std::vector<Descriptor>;

constexpr std::size_t kFeatures = 300;
const auto kAll = [](KeyframeId) { return true; };

// Bits as skewed as those of ORB, each with a probability of its own.
Place new_place(Random& random) {
  Place place(kFeatures);
  for (Descriptor& descriptor : place) {
    for (std::size_t b = 0; b < 256; ++b) {
      const double set = 0.1 + 0.8 * static_cast<double>(b * 37 % 256) / 255.0;
      descriptor[b / 64] |= std::uint64_t{random.chance(set)} << (b % 64);
    }
  }
  return place;
}

// The same corners seen again: a share of the bits flips, and a share of the corners is not found again.
Place seen_again(Place place, Random& random, double flips, double lost) {
  for (Descriptor& descriptor : place) {
    if (random.chance(lost)) {
      descriptor = new_place(random)[0];
      continue;
    }
    for (std::size_t b = 0; b < 256; ++b) {
      descriptor[b / 64] ^= std::uint64_t{random.chance(flips)} << (b % 64);
    }
  }
  return place;
}

struct World {
  std::vector<Place> places;
  PlaceIndex index;

  explicit World(std::size_t count, const PlaceIndexOptions& options = {}) : index(options) {
    Random random(7);
    for (std::uint32_t i = 0; i < count; ++i) {
      places.push_back(new_place(random));
      index.add(KeyframeId{i}, places.back());
    }
  }
};

TEST(PlaceIndex, an_empty_index_finds_nothing) {
  const PlaceIndex index({});
  Random random(1);
  EXPECT_TRUE(index.query(new_place(random), kAll).empty());
  EXPECT_EQ(index.size(), 0U);
}

TEST(PlaceIndex, a_place_seen_again_comes_first_though_bits_flip_and_corners_are_lost) {
  const World world(60);  // 18000 descriptors: keys were learned, tables have grown
  Random random(2);
  for (const std::uint32_t i : {0U, 3U, 17U, 59U}) {
    const auto found = world.index.query(seen_again(world.places[i], random, 0.15, 0.6), kAll);
    ASSERT_FALSE(found.empty());
    EXPECT_EQ(found[0].keyframe, KeyframeId{i});
    // Noise finds a stray feature or two; the place a good part of the 40 % that are still there.
    EXPECT_GT(found[0].score, 0.1);
    for (std::size_t k = 1; k < found.size(); ++k) EXPECT_LT(found[k].score, 0.1 * found[0].score);
  }
}

TEST(PlaceIndex, an_identical_picture_scores_one) {
  const World world(5);
  EXPECT_DOUBLE_EQ(world.index.query(world.places[2], kAll)[0].score, 1.0);
}

TEST(PlaceIndex, a_place_never_seen_scores_next_to_nothing) {
  const World world(60);
  Random random(3);
  for (const PlaceCandidate& c : world.index.query(new_place(random), kAll)) EXPECT_LT(c.score, 0.02);
}

TEST(PlaceIndex, only_eligible_keyframes_are_returned) {
  const World world(10);
  const auto found = world.index.query(world.places[4], [](KeyframeId id) { return id != KeyframeId{4}; });
  for (const PlaceCandidate& c : found) EXPECT_NE(c.keyframe, KeyframeId{4});
}

TEST(PlaceIndex, a_removed_keyframe_is_gone_and_may_come_back) {
  World world(60);
  for (std::uint32_t i = 0; i < 60; i += 2) world.index.remove(KeyframeId{i});
  world.index.remove(KeyframeId{0});      // gone already
  world.index.remove(KeyframeId{12345});  // never there
  EXPECT_EQ(world.index.size(), 30U);
  for (const PlaceCandidate& c : world.index.query(world.places[8], kAll)) {
    EXPECT_EQ(c.keyframe.value % 2, 1U);
  }
  EXPECT_DOUBLE_EQ(world.index.query(world.places[9], kAll)[0].score, 1.0);

  world.index.add(KeyframeId{8}, world.places[8]);
  EXPECT_EQ(world.index.query(world.places[8], kAll)[0].keyframe, KeyframeId{8});
}

TEST(PlaceIndex, removing_the_first_keyframes_before_keys_are_learned_does_no_harm) {
  Random random(4);
  PlaceIndex index({});
  std::vector<Place> places;
  for (std::uint32_t i = 0; i < 40; ++i) {
    places.push_back(new_place(random));
    index.add(KeyframeId{i}, places.back());
    if (i >= 3) index.remove(KeyframeId{i - 3});
  }
  EXPECT_EQ(index.size(), 3U);
  const auto found = index.query(places[38], kAll);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found[0].keyframe, KeyframeId{38});
}

TEST(PlaceIndex, a_keyframe_cannot_be_added_twice) {
  World world(3);
  EXPECT_THROW(world.index.add(KeyframeId{1}, world.places[1]), std::invalid_argument);
}

TEST(PlaceIndex, equal_keyframes_come_in_order_of_their_ids) {
  World world(2);
  world.index.add(KeyframeId{9}, world.places[0]);
  world.index.add(KeyframeId{5}, world.places[0]);
  const auto found = world.index.query(world.places[0], kAll);
  ASSERT_GE(found.size(), 3U);
  EXPECT_EQ(found[0].keyframe, KeyframeId{0});
  EXPECT_EQ(found[1].keyframe, KeyframeId{5});
  EXPECT_EQ(found[2].keyframe, KeyframeId{9});
}

TEST(PlaceIndex, what_is_everywhere_counts_less_than_what_is_rare) {
  Random random(5);
  const Place everywhere = new_place(random), rare = new_place(random);
  PlaceIndex index({});
  for (std::uint32_t i = 0; i < 20; ++i) index.add(KeyframeId{i}, everywhere);
  index.add(KeyframeId{20}, Place(rare.begin(), rare.begin() + 100));
  // The query has as many features of either kind; the keyframe with the rare ones wins.
  Place query(everywhere.begin(), everywhere.begin() + 100);
  query.insert(query.end(), rare.begin(), rare.begin() + 100);
  EXPECT_EQ(index.query(query, kAll)[0].keyframe, KeyframeId{20});
}

TEST(PlaceIndex, keyframes_and_queries_without_features_are_allowed) {
  World world(3);
  world.index.add(KeyframeId{3}, {});
  EXPECT_EQ(world.index.size(), 4U);
  EXPECT_TRUE(world.index.query({}, kAll).empty());
  world.index.remove(KeyframeId{3});
  EXPECT_EQ(world.index.size(), 3U);
}

TEST(PlaceIndex, the_same_calls_give_the_same_answers) {
  const World a(60), b(60);
  Random random(6);
  const Place query = seen_again(a.places[30], random, 0.2, 0.3);
  const auto in_a = a.index.query(query, kAll), in_b = b.index.query(query, kAll);
  ASSERT_EQ(in_a.size(), in_b.size());
  for (std::size_t i = 0; i < in_a.size(); ++i) {
    EXPECT_EQ(in_a[i].keyframe, in_b[i].keyframe);
    EXPECT_EQ(in_a[i].score, in_b[i].score);
  }
}

}  // namespace
}  // namespace ipl_slam
