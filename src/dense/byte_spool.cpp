#include "dense/byte_spool.hpp"

#include <cerrno>
#include <cstdlib>
#include <stdexcept>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <ipl_slam/error.hpp>

namespace ipl_slam {

ByteSpool::ByteSpool() {
  std::error_code error;
  folder_ = std::filesystem::temp_directory_path(error);
  if (error) {
    throw UserError(
        fmt::format("no folder for temporary files ({}); name one that is there in the environment variable "
                    "TMPDIR",
                    error.message()));
  }
  std::string name = (folder_ / "ipl_slam_XXXXXX").string();
  fd_ = ::mkostemp(name.data(), O_CLOEXEC);
  if (fd_ < 0) fail("made", errno);
  ::unlink(name.c_str());
}

ByteSpool::~ByteSpool() {
  ::close(fd_);
}

ByteSpool::Slot ByteSpool::append(std::string_view bytes) {
  const Slot slot{end_, bytes.size()};
  for (std::uint64_t at = end_; !bytes.empty();) {
    const ssize_t n = ::pwrite(fd_, bytes.data(), bytes.size(), static_cast<off_t>(at));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail("written", errno);
    bytes.remove_prefix(static_cast<std::size_t>(n));
    at += static_cast<std::uint64_t>(n);
  }
  end_ += slot.size;
  return slot;
}

std::string ByteSpool::read(const Slot& slot) const {
  if (slot.offset + slot.size > end_) throw std::invalid_argument("ByteSpool: no such slot");
  std::string bytes(slot.size, '\0');
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t n =
        ::pread(fd_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(slot.offset + done));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) fail("read", n < 0 ? errno : EIO);
    done += static_cast<std::size_t>(n);
  }
  return bytes;
}

void ByteSpool::fail(const char* verb, int error) const {
  const std::string reason = error == ENOSPC ? "disk full" : std::generic_category().message(error);
  throw UserError(
      fmt::format("a temporary file in '{}' cannot be {} ({}); free some space there, or name a folder on "
                  "another disk in the environment variable TMPDIR",
                  folder_.string(), verb, reason));
}

}  // namespace ipl_slam
