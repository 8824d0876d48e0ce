#pragma once

#include <stdexcept>

#include <ipl_slam/export.hpp>

namespace ipl_slam {

/// An error its reader can mend: a missing file, a bad setting, a full disk. The message is one line that
/// names the file and the mend; the command line prints it and exits with code 2. Anything else that is
/// thrown is a bug.
class IPL_SLAM_API UserError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace ipl_slam
