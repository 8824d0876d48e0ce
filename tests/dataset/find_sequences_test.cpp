#include "dataset/find_sequences.hpp"

#include <gtest/gtest.h>

#include <ipl_slam/error.hpp>

#include "temporary_folder.hpp"

namespace ipl_slam {
namespace {

namespace fs = std::filesystem;
using testing::TemporaryFolder;

std::vector<std::string> found_in(const fs::path& root) {
  std::vector<std::string> names;
  for (const fs::path& folder : find_sequences(root)) {
    names.push_back(folder.lexically_relative(root).generic_string());
  }
  return names;
}

TEST(FindSequences, FindsThemAtAnyDepthInOrder) {
  const TemporaryFolder folder;
  for (const char* file : {"tum/fr3/walking/rgb.txt", "bonn/balloon/rgb.txt", "pairs/associations.txt",
                           "other/depth.txt", "notes/readme.txt"}) {
    folder.write(file, "");
  }
  EXPECT_EQ(found_in(folder.path()), (std::vector<std::string>{"bonn/balloon", "pairs", "tum/fr3/walking"}));
}

TEST(FindSequences, TakesAFolderThatIsOneForItself) {
  const TemporaryFolder folder;
  folder.write("rgb.txt", "");
  folder.write("copy/rgb.txt", "");
  EXPECT_EQ(found_in(folder.path()), std::vector<std::string>{"."})
      << "inside a sequence nothing is looked for";
}

TEST(FindSequences, FollowsLinksButNotInCircles) {
  const TemporaryFolder folder, elsewhere;
  elsewhere.write("room/rgb.txt", "");
  folder.write("a/walk/rgb.txt", "");
  fs::create_directory_symlink(elsewhere.path(), folder / "link");
  fs::create_directory_symlink(folder.path(), folder / "a/up");
  EXPECT_EQ(found_in(folder.path()), (std::vector<std::string>{"a/walk", "link/room"}));
}

TEST(FindSequences, NeedsAFolder) {
  const TemporaryFolder folder;
  EXPECT_TRUE(find_sequences(folder.path()).empty());
  EXPECT_THROW((void)find_sequences(folder / "nowhere"), UserError);
  EXPECT_THROW((void)find_sequences(folder.write("file", "")), UserError);
}

}  // namespace
}  // namespace ipl_slam
