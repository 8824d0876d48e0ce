#include "common/fingerprint.hpp"

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

// The test vectors its authors publish for the 64-bit FNV-1a.
TEST(Fingerprint, IsThePublishedHash) {
  EXPECT_EQ(fingerprint(""), "cbf29ce484222325");
  EXPECT_EQ(fingerprint("a"), "af63dc4c8601ec8c");
  EXPECT_EQ(fingerprint("foobar"), "85944171f73967e8");
}

}  // namespace
}  // namespace ipl_slam
