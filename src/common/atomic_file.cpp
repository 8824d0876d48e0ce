#include "common/atomic_file.hpp"

#include <atomic>
#include <cerrno>
#include <system_error>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>
#include <sys/stat.h>
#include <unistd.h>

#include <ipl_slam/error.hpp>

namespace ipl_slam {
namespace {

namespace fs = std::filesystem;

// One write call stays below what the kernel takes at once (2 GiB), and a signal loses little work.
constexpr std::size_t kWriteChunk = std::size_t{1} << 26;

/// What went wrong and what to do about it, for an errno of open, write, fsync, close or rename.
std::string reason_and_mend(int error) {
  switch (error) {
    case ENOSPC:
      return "disk full; free some space or write to another disk";
    case EDQUOT:
      return "disk quota used up; free some space or write to another disk";
    case EFBIG:
      return "file size limit reached; raise it (ulimit -f) or write less";
    case ENOENT:
      return "its folder does not exist; create it first";
    case ENOTDIR:
      return "a part of its path is a file, not a folder; choose another path";
    case EISDIR:
      return "it is a folder; give the name of a file";
    case EACCES:
    case EPERM:
      return "no permission; choose a folder you may write to";
    case EROFS:
      return "the file system is read-only; write to another disk";
    case ENAMETOOLONG:
      return "the name is too long; choose a shorter one";
    default:
      return std::generic_category().message(error) + "; choose another place";
  }
}

[[noreturn]] void fail(const fs::path& file, int error) {
  throw UserError(fmt::format("cannot write '{}': {}", file.string(), reason_and_mend(error)));
}

/// An open file descriptor that is closed, and its temporary file removed, unless everything went well.
class Output {
 public:
  Output(const fs::path& reported, fs::path opened, int flags, bool temporary)
      : reported_(reported), opened_(std::move(opened)), temporary_(temporary) {
    do fd_ = ::open(opened_.c_str(), flags | O_WRONLY | O_CLOEXEC, 0666);
    while (fd_ < 0 && errno == EINTR);
    if (fd_ < 0) fail(reported_, errno);
  }
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;
  ~Output() {
    if (fd_ >= 0) ::close(fd_);
    if (temporary_) ::unlink(opened_.c_str());
  }

  void write(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t n = ::write(fd_, bytes.data(), std::min(bytes.size(), kWriteChunk));
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) fail(reported_, errno);
      bytes.remove_prefix(static_cast<std::size_t>(n));
    }
  }

  void flush_to_disk() {
    // EINVAL and ENOTSUP: the file system has nothing to flush to.
    if (::fsync(fd_) != 0 && errno != EINVAL && errno != ENOTSUP) fail(reported_, errno);
  }

  void close() {
    const int fd = fd_;
    fd_ = -1;
    // After EINTR, Linux has closed the descriptor all the same.
    if (::close(fd) != 0 && errno != EINTR) fail(reported_, errno);
  }

  void rename_to(const fs::path& target) {
    if (::rename(opened_.c_str(), target.c_str()) != 0) fail(reported_, errno);
    temporary_ = false;
  }

 private:
  fs::path reported_, opened_;
  bool temporary_;
  int fd_ = -1;
};

/// A name no other thread or process uses; short, so that it fits wherever the target's own name does.
fs::path temporary_beside(const fs::path& target) {
  static std::atomic<unsigned> counter{0};
  return target.parent_path() / fmt::format(".tmp-{}-{}", ::getpid(), counter++);
}

/// Where a symbolic link leads, so that the file is replaced and not the link.
fs::path link_target(const fs::path& file) {
  std::error_code error;
  if (!fs::is_symlink(file, error)) return file;
  const fs::path target = fs::weakly_canonical(file, error);
  return error ? file : target;
}

/// Where a file's bytes go.
struct Target {
  fs::path path;         // links followed
  bool special = false;  // a device or pipe that is there, to be written to directly
};

/// Throws where its name alone tells that it cannot be written.
Target check_target(const fs::path& file) {
  if (file.filename().empty() || file.filename() == "." || file.filename() == "..") fail(file, EISDIR);
  const fs::path target = link_target(file);
  struct stat status = {};
  const bool exists = ::stat(target.c_str(), &status) == 0;
  if (exists && S_ISDIR(status.st_mode)) fail(file, EISDIR);
  if (target.filename().native().size() > 255) fail(file, ENAMETOOLONG);
  return {target, exists && !S_ISREG(status.st_mode)};
}

}  // namespace

void write_file_atomically(const fs::path& file, std::string_view content) {
  const Target target = check_target(file);
  if (target.special) {
    Output output(file, target.path, 0, false);
    output.write(content);
    output.close();
    return;
  }
  Output output(file, temporary_beside(target.path), O_CREAT | O_EXCL, true);
  output.write(content);
  output.flush_to_disk();
  output.close();
  output.rename_to(target.path);
}

void check_writable(const fs::path& file) {
  const Target target = check_target(file);
  // Nothing is opened that may notice, as a pipe would.
  if (target.special) return;
  const Output probe(file, temporary_beside(target.path), O_CREAT | O_EXCL, true);
}

void write_image_atomically(const fs::path& file, const cv::Mat& image) {
  std::vector<unsigned char> bytes;
  bool encoded = false;
  try {
    encoded = cv::imencode(file.extension().string(), image, bytes);
  } catch (const cv::Exception&) {
    // No encoder for the extension, or none for the image's type; said below.
  }
  if (!encoded) {
    throw UserError(fmt::format("cannot write '{}': '{}' is no image format for this picture; use .png",
                                file.string(), file.extension().string()));
  }
  write_file_atomically(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace ipl_slam
