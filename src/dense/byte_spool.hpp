#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace ipl_slam {

/// Bytes that are kept on the disk instead of in memory, in a file without a name: it goes when the spool
/// goes, however the program ends. It lies in $TMPDIR, or in /tmp. Used by one thread at a time.
class ByteSpool {
 public:
  /// Where bytes lie.
  struct Slot {
    std::uint64_t offset = 0;
    std::size_t size = 0;
  };

  /// Throws UserError where the folder takes no file.
  ByteSpool();
  ~ByteSpool();
  ByteSpool(const ByteSpool&) = delete;
  ByteSpool& operator=(const ByteSpool&) = delete;

  /// Throws UserError that names folder and mend when the disk is full; what was appended before stays.
  Slot append(std::string_view bytes);
  /// slot: as append() gave it.
  [[nodiscard]] std::string read(const Slot& slot) const;
  /// All that was appended.
  [[nodiscard]] std::size_t bytes() const { return static_cast<std::size_t>(end_); }

 private:
  [[noreturn]] void fail(const char* verb, int error) const;

  std::filesystem::path folder_;
  int fd_ = -1;
  std::uint64_t end_ = 0;
};

}  // namespace ipl_slam
