#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/ids.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {

/// A pose with its time: camera-to-world T_wc, seconds.
struct StampedPose {
  double timestamp = 0.0;
  SE3 T_wc;
};

/// Poses in order of time.
using Trajectory = std::vector<StampedPose>;

/// Poses in the world of one part of a map. Where one part lies relative to another is not known.
struct TrajectoryPart {
  PartId part;
  Trajectory poses;
};

/// Sorts poses by the part they belong to.
class TrajectoryParts {
 public:
  void add(PartId part, const StampedPose& pose);
  /// The longest list first, among equals that of the older part; one empty list where there is no pose.
  [[nodiscard]] std::vector<TrajectoryPart> longest_first() const;

 private:
  std::map<PartId, TrajectoryPart> parts_;
};

/// Reads a TUM trajectory file: lines "timestamp tx ty tz qx qy qz qw", '#' comments. Lines with NaN,
/// infinities or a zero quaternion are left out and counted in `rejected` (may be null). Duplicate and
/// backward timestamps likewise. Throws UserError (file, line, mend) when the file cannot be read, a line
/// cannot be parsed, or no pose is left.
[[nodiscard]] Trajectory read_trajectory(const std::filesystem::path& file, std::size_t* rejected = nullptr);

/// Writes a TUM trajectory file (timestamps with 6 decimals, values with 9), atomically: beside, then
/// renamed. Throws UserError when it cannot be written.
void write_trajectory(const std::filesystem::path& file, const Trajectory& trajectory);
/// The same of several parts. The first one's poses are the file's; those of the others follow as comments
/// "# part 2: timestamp tx ty tz qx qy qz qw": readers of the format see poses of one world only.
[[nodiscard]] std::string trajectory_text(const std::vector<TrajectoryPart>& parts);
void write_trajectory(const std::filesystem::path& file, const std::vector<TrajectoryPart>& parts);

}  // namespace ipl_slam
