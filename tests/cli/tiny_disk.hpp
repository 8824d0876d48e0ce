#pragma once

#include <filesystem>

#include <sys/mount.h>

#include "dataset/temporary_folder.hpp"

namespace ipl_slam::testing {

/// A file system of a few kilobytes, where the machine allows to mount one.
class TinyDisk {
 public:
  explicit TinyDisk(const char* size) {
    mounted_ = ::mount("tmpfs", folder_.path().c_str(), "tmpfs", 0, size) == 0;
  }
  ~TinyDisk() {
    if (mounted_) ::umount2(folder_.path().c_str(), MNT_DETACH);
  }
  [[nodiscard]] bool mounted() const { return mounted_; }
  [[nodiscard]] std::filesystem::path path() const { return folder_.path(); }

 private:
  TemporaryFolder folder_;
  bool mounted_ = false;
};

}  // namespace ipl_slam::testing
