#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "program.hpp"

namespace ipl_slam::testing {

/// An error its reader can mend: exit code 2 and one line on stderr that holds `words`.
inline void expect_refused(const Finished& finished, const std::vector<std::string>& words) {
  EXPECT_EQ(finished.code, 2) << finished.err;
  EXPECT_EQ(std::count(finished.err.begin(), finished.err.end(), '\n'), 1) << finished.err;
  EXPECT_THAT(finished.err, ::testing::StartsWith("ipl_slam"));
  EXPECT_THAT(finished.err, ::testing::Not(::testing::HasSubstr("internal error")));
  for (const std::string& word : words) EXPECT_THAT(finished.err, ::testing::HasSubstr(word));
}

}  // namespace ipl_slam::testing
