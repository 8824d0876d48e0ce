#include "dense/byte_spool.hpp"

#include <csignal>
#include <cstdlib>
#include <optional>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <ipl_slam/error.hpp>

#include "dataset/temporary_folder.hpp"

namespace ipl_slam {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::message_of;
using testing::TemporaryFolder;

/// TMPDIR is another one while this lives.
class OtherTmpdir {
 public:
  explicit OtherTmpdir(const std::string& folder) {
    if (const char* before = std::getenv("TMPDIR")) before_ = before;
    ::setenv("TMPDIR", folder.c_str(), 1);
  }
  ~OtherTmpdir() { before_ ? ::setenv("TMPDIR", before_->c_str(), 1) : ::unsetenv("TMPDIR"); }

 private:
  std::optional<std::string> before_;
};

TEST(ByteSpool, GivesBackWhatWasAppendedInAnyOrder) {
  ByteSpool spool;
  const auto first = spool.append("first");
  const auto empty = spool.append("");
  const auto second = spool.append(std::string("a\0b", 3));
  EXPECT_EQ(spool.read(second), std::string("a\0b", 3));
  EXPECT_EQ(spool.read(first), "first");
  EXPECT_EQ(spool.read(empty), "");
  EXPECT_EQ(spool.bytes(), 8U);
  EXPECT_THROW((void)spool.read({6, 3}), std::invalid_argument);
}

TEST(ByteSpool, LeavesNoFileInTheFolderOfTMPDIR) {
  const TemporaryFolder folder;
  const OtherTmpdir tmpdir(folder.path().string());
  ByteSpool spool;
  const auto slot = spool.append("content");
  EXPECT_TRUE(folder.names().empty());
  EXPECT_EQ(spool.read(slot), "content");
}

TEST(ByteSpool, SaysWhatToDoWithoutAFolder) {
  const OtherTmpdir tmpdir("/nowhere/at/all");
  EXPECT_THAT(message_of<UserError>([] { ByteSpool(); }), HasSubstr("TMPDIR"));
}

TEST(ByteSpool, SaysWhereTheDiskIsFullAndKeepsWhatItHas) {
  const TemporaryFolder folder;
  const OtherTmpdir tmpdir(folder.path().string());
  ByteSpool spool;
  const auto slot = spool.append("content");
  // A limit on the size of files stands for the end of the disk.
  struct rlimit before = {};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  struct rlimit small = before;
  small.rlim_cur = 100;
  auto* const handler = std::signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  const std::string message = message_of<UserError>([&] { spool.append(std::string(1000, 'x')); });
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_THAT(message, AllOf(HasSubstr(folder.path().string()), HasSubstr("TMPDIR")));
  EXPECT_EQ(spool.read(slot), "content");
  EXPECT_EQ(spool.read(spool.append("more")), "more");
}

}  // namespace
}  // namespace ipl_slam
