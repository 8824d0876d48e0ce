#include "common/nearest_name.hpp"

#include <vector>

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

TEST(EditDistance, CountsInsertionsDeletionsAndReplacements) {
  EXPECT_EQ(edit_distance("", ""), 0U);
  EXPECT_EQ(edit_distance("", "abc"), 3U);
  EXPECT_EQ(edit_distance("abc", ""), 3U);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3U);
  EXPECT_EQ(edit_distance("features", "featurs"), 1U);
}

TEST(EditDistance, DoesNotMindCase) {
  EXPECT_EQ(edit_distance("Run", "rUN"), 0U);
}

TEST(NearestName, IsTheOneWithTheFewestEdits) {
  const std::vector<std::string> verbs = {"run", "eval", "synth"};
  EXPECT_EQ(nearest_name("rnu", verbs), "run");
  EXPECT_EQ(nearest_name("evaluate", verbs), "eval");
  EXPECT_EQ(nearest_name("synht", verbs), "synth");
}

TEST(NearestName, IsTheFirstOfEqualsAndEmptyWithoutCandidates) {
  const std::vector<std::string> names = {"ab", "ac"};
  EXPECT_EQ(nearest_name("ad", names), "ab");
  EXPECT_EQ(nearest_name("x", {}), "");
}

}  // namespace
}  // namespace ipl_slam
