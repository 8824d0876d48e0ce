// The writer of OctoMap files as it is in a build without liboctomap: this program takes
// octomap_file_missing.cpp, whatever the library was built with.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ipl_slam/error.hpp>

#include "dataset/temporary_folder.hpp"
#include "dense/octomap_file.hpp"

namespace ipl_slam {
namespace {

TEST(WithoutOctomap, TheWriterSaysHowToGetIt) {
  ASSERT_FALSE(has_octomap());
  const OccupancyGrid grid(OccupancyOptions{});
  EXPECT_THAT(testing::message_of<UserError>([&] { (void)octomap_bt(grid); }),
              ::testing::HasSubstr("liboctomap-dev"));
}

}  // namespace
}  // namespace ipl_slam
