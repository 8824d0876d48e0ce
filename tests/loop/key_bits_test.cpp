#include "loop/key_bits.hpp"

#include <algorithm>
#include <set>
#include <stdexcept>

#include <gtest/gtest.h>

#include "common/random.hpp"

namespace ipl_slam {
namespace {

// Bits 0 to 19 are fair and independent, 20 to 39 repeat them, the others are nearly always 0.
std::vector<Descriptor> descriptors() {
  Random random(1);
  std::vector<Descriptor> all(2000);
  for (Descriptor& d : all) {
    const std::uint64_t fair = random.bits() & 0xFFFFF;
    d[0] = fair | fair << 20;
    for (std::size_t b = 40; b < 256; ++b) d[b / 64] |= std::uint64_t{random.chance(0.02)} << (b % 64);
  }
  return all;
}

TEST(KeyBits, fair_bits_are_chosen_and_no_key_holds_a_bit_and_its_repetition) {
  const std::vector<KeyBits> keys = choose_key_bits(descriptors(), 2, 15);
  for (const KeyBits& key : keys) {
    ASSERT_EQ(key.size(), 15U);
    std::set<int> told;
    for (const std::uint8_t bit : key) {
      EXPECT_LT(bit, 40);
      EXPECT_TRUE(told.insert(bit % 20).second) << int{bit};
    }
  }
}

TEST(KeyBits, no_bit_is_used_twice) {
  const std::vector<KeyBits> keys = choose_key_bits(descriptors(), 8, 32);
  std::set<std::uint8_t> used;
  for (const KeyBits& key : keys) used.insert(key.begin(), key.end());
  EXPECT_EQ(used.size(), 256U);
}

TEST(KeyBits, descriptors_that_tell_nothing_give_keys_too) {
  for (const std::size_t count : {0U, 1U, 100U}) {
    const std::vector<KeyBits> keys = choose_key_bits(std::vector<Descriptor>(count), 7, 32);
    ASSERT_EQ(keys.size(), 7U);
    EXPECT_EQ(keys[6].size(), 32U);
  }
}

TEST(KeyBits, more_bits_than_there_are_is_refused) {
  EXPECT_THROW((void)choose_key_bits({}, 9, 32), std::invalid_argument);
}

}  // namespace
}  // namespace ipl_slam
