#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "geometry/se3.hpp"

namespace ipl_slam {

/// A pose with its time: camera-to-world T_wc, seconds.
struct StampedPose {
  double timestamp = 0.0;
  SE3 T_wc;
};

/// Poses in order of time.
using Trajectory = std::vector<StampedPose>;

/// Reads a TUM trajectory file: lines "timestamp tx ty tz qx qy qz qw", '#' comments. Lines with NaN,
/// infinities or a zero quaternion are left out and counted in `rejected` (may be null). Duplicate and
/// backward timestamps likewise. Throws UserError (file, line, mend) when the file cannot be read, a line
/// cannot be parsed, or no pose is left.
[[nodiscard]] Trajectory read_trajectory(const std::filesystem::path& file, std::size_t* rejected = nullptr);

/// A pose as a line of such a file, with its line end: timestamps with 6 decimals, values with 9.
[[nodiscard]] std::string pose_text(const StampedPose& pose);
/// The whole file: a comment that names the columns, then the poses.
[[nodiscard]] std::string trajectory_text(const Trajectory& trajectory);

/// Writes a TUM trajectory file (timestamps with 6 decimals, values with 9), atomically: beside, then
/// renamed. Throws UserError when it cannot be written.
void write_trajectory(const std::filesystem::path& file, const Trajectory& trajectory);

}  // namespace ipl_slam
