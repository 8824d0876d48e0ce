#include "common/atomic_file.hpp"

#include <csignal>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <ipl_slam/error.hpp>

#include "dataset/image_file.hpp"
#include "dataset/temporary_folder.hpp"

namespace ipl_slam {
namespace {

using testing::content_of;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::message_of;
using testing::TemporaryFolder;

/// Files of this process cannot grow beyond `bytes` while this lives: works as a full disk without one.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    previous_handler_ = std::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &previous_);
    rlimit limit = previous_;
    limit.rlim_cur = bytes;
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    ::setrlimit(RLIMIT_FSIZE, &previous_);
    std::signal(SIGXFSZ, previous_handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit previous_{};
  void (*previous_handler_)(int) = SIG_DFL;
};

std::string failure_of_writing(const std::filesystem::path& file, const std::string& content = "text") {
  return message_of<UserError>([&] { write_file_atomically(file, content); });
}

TEST(AtomicFile, HoldsTheBytesGivenAndNothingElseRemains) {
  const TemporaryFolder folder;
  const std::string bytes("a\0b\r\n", 5);
  write_file_atomically(folder / "out.bin", bytes);
  EXPECT_EQ(content_of(folder / "out.bin"), bytes);
  EXPECT_THAT(folder.names(), ElementsAre("out.bin"));
}

TEST(AtomicFile, ReplacesAFile) {
  const TemporaryFolder folder;
  folder.write("out.txt", "a longer old text");
  write_file_atomically(folder / "out.txt", "new");
  EXPECT_EQ(content_of(folder / "out.txt"), "new");
}

TEST(AtomicFile, ReplacesWhatALinkLeadsToAndNotTheLink) {
  const TemporaryFolder folder;
  folder.write("real.txt", "old");
  std::filesystem::create_symlink("real.txt", folder / "link.txt");
  write_file_atomically(folder / "link.txt", "new");
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link.txt"));
  EXPECT_EQ(content_of(folder / "real.txt"), "new");
}

TEST(AtomicFile, WritesWithAFileNameAsLongAsTheSystemAllows) {
  const TemporaryFolder folder;
  const std::string name(255, 'n');
  write_file_atomically(folder / name, "text");
  EXPECT_EQ(content_of(folder / name), "text");
}

TEST(AtomicFile, SaysThatTheFolderIsMissing) {
  const TemporaryFolder folder;
  const std::string message = failure_of_writing(folder / "none/out.txt");
  EXPECT_THAT(message, HasSubstr((folder / "none/out.txt").string()));
  EXPECT_THAT(message, HasSubstr("folder does not exist"));
}

TEST(AtomicFile, SaysThatAPartOfThePathIsAFile) {
  const TemporaryFolder folder;
  folder.write("file", "x");
  EXPECT_THAT(failure_of_writing(folder / "file/out.txt"), HasSubstr("is a file, not a folder"));
}

TEST(AtomicFile, SaysThatThePathIsAFolder) {
  const TemporaryFolder folder;
  EXPECT_THAT(failure_of_writing(folder.path()), HasSubstr("it is a folder"));
  EXPECT_THAT(failure_of_writing(folder / ""), HasSubstr("it is a folder"));
}

TEST(AtomicFile, SaysThatTheDiskIsFullWhenADeviceTakesNothing) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  EXPECT_THAT(failure_of_writing("/dev/full"), HasSubstr("'/dev/full': disk full; free some space"));
}

TEST(AtomicFile, KeepsTheOldFileAndLeavesNoTemporaryWhenWritingStopsHalfway) {
  const TemporaryFolder folder;
  folder.write("out.txt", "old");
  std::string message;
  {
    const FileSizeLimit limit(4096);
    message = failure_of_writing(folder / "out.txt", std::string(10000, 'x'));
  }
  EXPECT_THAT(message, HasSubstr("out.txt': file size limit reached"));
  EXPECT_EQ(content_of(folder / "out.txt"), "old");
  EXPECT_THAT(folder.names(), ElementsAre("out.txt"));
}

// The real thing: a disk of 64 KiB, mounted in a child process that has the mount to itself.
TEST(AtomicFile, LeavesAFullDiskAsItWas) {
  constexpr int cannot_mount = 77, wrong_message = 1, something_left = 2, good = 0;
  const TemporaryFolder disk;
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    if (::unshare(CLONE_NEWNS) != 0 || ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
        ::mount("tmpfs", disk.path().c_str(), "tmpfs", 0, "size=64k") != 0) {
      ::_exit(cannot_mount);
    }
    const std::string message = failure_of_writing(disk / "out.txt", std::string(200000, 'x'));
    if (message.find("out.txt': disk full") == std::string::npos) ::_exit(wrong_message);
    ::_exit(disk.names().empty() ? good : something_left);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  if (WEXITSTATUS(status) == cannot_mount) GTEST_SKIP() << "no permission to mount a small tmpfs";
  EXPECT_EQ(WEXITSTATUS(status), good);
}

TEST(CheckWritable, LeavesNoTraceWhereAFileCouldBeWritten) {
  const TemporaryFolder folder;
  const auto file = folder / "a";
  check_writable(file);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  write_file_atomically(file, "old");
  check_writable(file);
  EXPECT_EQ(content_of(file), "old");
  check_writable("/dev/null");
}

TEST(CheckWritable, RefusesWhatWritingWouldRefuse) {
  const TemporaryFolder folder;
  const auto file = folder.write("file", "");
  for (const std::filesystem::path& path : {file / "a", folder / "nowhere/a", folder.path(),
                                            folder / std::string(300, 'a'), std::filesystem::path()}) {
    const std::string refused = message_of<UserError>([&] { check_writable(path); });
    EXPECT_FALSE(refused.empty()) << path;
    EXPECT_EQ(refused, message_of<UserError>([&] { write_file_atomically(path, "x"); }));
  }
}

TEST(AtomicImage, IsReadBackWithTheSamePixels) {
  const TemporaryFolder folder;
  cv::Mat depth(5, 7, CV_16UC1);
  for (int i = 0; i < 35; ++i) depth.at<std::uint16_t>(i / 7, i % 7) = static_cast<std::uint16_t>(1000 * i);
  write_image_atomically(folder / "depth.png", depth);
  const cv::Mat back = load_image(folder / "depth.png").image;
  ASSERT_EQ(back.type(), CV_16UC1);
  EXPECT_EQ(cv::norm(depth, back, cv::NORM_INF), 0.0);
}

TEST(AtomicImage, RefusesAnExtensionThatIsNoImageFormat) {
  const TemporaryFolder folder;
  const cv::Mat image(4, 4, CV_8UC3, cv::Scalar::all(9));
  for (const char* name : {"plot.foo", "plot"}) {
    const std::string message = message_of<UserError>([&] { write_image_atomically(folder / name, image); });
    EXPECT_THAT(message, HasSubstr("is no image format")) << name;
  }
  EXPECT_TRUE(folder.names().empty());
}

}  // namespace
}  // namespace ipl_slam
