#include "dense/block_bits.hpp"

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

using Bits = BlockBits<VoxelBlock::kVoxels>;

TEST(BlockBits, NumberTheirMembersByBlockAndPlace) {
  Bits bits({{-1, 0, 0}, {0, 0, 0}, {4, 2, 0}});
  bits.insert(2, 7);
  bits.insert(0, 511);
  bits.insert(0, 64);
  bits.insert(2, 6);
  bits.insert(2, 6);
  EXPECT_EQ(bits.number(), 4U);
  EXPECT_EQ(bits.number_of(0, 64), 0U);
  EXPECT_EQ(bits.number_of(0, 511), 1U);
  EXPECT_EQ(bits.number_of(2, 6), 2U);
  EXPECT_EQ(bits.number_of(2, 7), 3U);
  EXPECT_TRUE(bits.contains(2, 7));
  EXPECT_FALSE(bits.contains(1, 7));
  EXPECT_FALSE(bits.contains(2, 8));
}

TEST(BlockBits, KnowTheBlocksAround) {
  const Bits bits({{-1, -1, -1}, {-1, 0, 0}, {0, 0, 0}, {0, 1, -1}});
  const Bits::Neighbours around = bits.neighbours(2);
  EXPECT_EQ(Bits::holder(around, 0, 7, 3), 2U);
  EXPECT_EQ(Bits::holder(around, -1, 0, 0), 1U);
  EXPECT_EQ(Bits::holder(around, -1, -1, -1), 0U);
  EXPECT_EQ(Bits::holder(around, 7, 8, -1), 3U);
  EXPECT_EQ(Bits::holder(around, 8, 0, 0), Bits::kNone);
}

}  // namespace
}  // namespace ipl_slam
