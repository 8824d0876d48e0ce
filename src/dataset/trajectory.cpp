#include "dataset/trajectory.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

#include "common/atomic_file.hpp"
#include "common/text_file.hpp"

namespace ipl_slam {
namespace {

constexpr std::size_t kColumns = 8;  // timestamp tx ty tz qx qy qz qw

// A quaternion this short stands for "no rotation known"; it is no rounded unit quaternion.
constexpr double kZeroQuaternion = 1e-6;

using Row = std::array<double, kColumns>;

std::optional<Row> parse_row(std::string_view line) {
  const std::vector<std::string_view> words = split_words(line);
  if (words.size() != kColumns) return std::nullopt;
  Row row;
  for (std::size_t i = 0; i < kColumns; ++i) {
    const std::optional<double> value = parse_number(words[i]);
    if (!value) return std::nullopt;
    row[i] = *value;
  }
  return row;
}

std::optional<StampedPose> to_pose(const Row& row) {
  for (const double value : row) {
    if (!std::isfinite(value)) return std::nullopt;
  }
  const Eigen::Quaterniond rotation(row[7], row[4], row[5], row[6]);
  if (!(rotation.norm() > kZeroQuaternion)) return std::nullopt;
  return StampedPose{row[0], SE3(rotation, Eigen::Vector3d(row[1], row[2], row[3]))};
}

}  // namespace

Trajectory read_trajectory(const std::filesystem::path& file, std::size_t* rejected) {
  Trajectory trajectory;
  const std::vector<TextLine> lines = read_lines(file);
  for (const TextLine& line : lines) {
    const std::optional<Row> row = parse_row(line.text);
    if (!row) {
      throw UserError(
          fmt::format("{}:{}: cannot understand '{:.60}'; a line of a trajectory reads "
                      "\"timestamp tx ty tz qx qy qz qw\"",
                      file.string(), line.number, line.text));
    }
    const std::optional<StampedPose> pose = to_pose(*row);
    if (!pose || (!trajectory.empty() && pose->timestamp <= trajectory.back().timestamp)) continue;
    trajectory.push_back(*pose);
  }
  if (rejected != nullptr) *rejected = lines.size() - trajectory.size();
  if (trajectory.empty()) {
    throw UserError(
        fmt::format("'{}' holds no pose{}; a line of a trajectory reads \"timestamp tx ty tz qx qy qz qw\"",
                    file.string(), lines.empty() ? "" : " without NaN"));
  }
  return trajectory;
}

void TrajectoryParts::add(PartId part, const StampedPose& pose) {
  parts_[part].part = part;
  parts_[part].poses.push_back(pose);
}

std::vector<TrajectoryPart> TrajectoryParts::longest_first() const {
  std::vector<TrajectoryPart> sorted;
  for (const auto& [part, list] : parts_) sorted.push_back(list);
  std::stable_sort(sorted.begin(), sorted.end(), [](const TrajectoryPart& a, const TrajectoryPart& b) {
    return a.poses.size() > b.poses.size();
  });
  if (sorted.empty()) sorted.emplace_back();
  return sorted;
}

std::string trajectory_text(const std::vector<TrajectoryPart>& parts) {
  std::string text = "# timestamp tx ty tz qx qy qz qw (camera to world, s, m)\n";
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::string mark = i == 0 ? "" : fmt::format("# part {}: ", parts[i].part.value);
    for (const StampedPose& pose : parts[i].poses) {
      const Eigen::Vector3d& t = pose.T_wc.translation();
      const Eigen::Quaterniond& q = pose.T_wc.rotation();
      fmt::format_to(std::back_inserter(text), "{}{:.6f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n",
                     mark, pose.timestamp, t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
    }
  }
  return text;
}

void write_trajectory(const std::filesystem::path& file, const std::vector<TrajectoryPart>& parts) {
  write_file_atomically(file, trajectory_text(parts));
}

void write_trajectory(const std::filesystem::path& file, const Trajectory& trajectory) {
  write_trajectory(file, std::vector<TrajectoryPart>{{PartId{}, trajectory}});
}

}  // namespace ipl_slam
