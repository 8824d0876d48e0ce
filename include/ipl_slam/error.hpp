#pragma once

#include <stdexcept>
#include <string>

#include <ipl_slam/export.hpp>

namespace ipl_slam {

/// An error its reader can mend: a missing file, a bad setting, a full disk. The message is one line that
/// names the file and the mend; the command line prints it and exits with code 2. Anything else that is
/// thrown is a bug.
class IPL_SLAM_API UserError : public std::runtime_error {
 public:
  explicit UserError(const std::string& message) : std::runtime_error(one_line(message)) {}

 private:
  // Messages quote files, which may hold line ends and codes that a terminal would obey.
  static std::string one_line(std::string message) {
    for (char& c : message) {
      if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = '?';
    }
    return message;
  }
};

}  // namespace ipl_slam
