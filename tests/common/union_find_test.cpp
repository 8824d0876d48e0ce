#include "common/union_find.hpp"

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

TEST(UnionFind, NamesASetByItsLeastMemberWhateverTheOrder) {
  UnionFind a(6), b(6);
  a.join(5, 3);
  a.join(1, 4);
  a.join(4, 5);
  b.join(3, 4);
  b.join(4, 5);
  b.join(5, 1);
  for (UnionFind* sets : {&a, &b}) {
    for (const std::uint32_t i : {1U, 3U, 4U, 5U}) EXPECT_EQ(sets->find(i), 1U);
    EXPECT_EQ(sets->find(0), 0U);
    EXPECT_EQ(sets->find(2), 2U);
  }
}

}  // namespace
}  // namespace ipl_slam
