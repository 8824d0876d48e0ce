#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "dataset/trajectory.hpp"
#include "map/map_file.hpp"

namespace ipl_slam {

/// What `ipl_slam map info` says of a map: version, camera, counts, extent (m) and time span (s) of its
/// parts.
[[nodiscard]] nlohmann::ordered_json map_summary(const SavedMap& saved);

/// The part with most keyframes, among equals the oldest; invalid for a map without keyframes.
[[nodiscard]] PartId largest_part(const Map& map);

/// The poses of the keyframes of a part in order of id.
[[nodiscard]] Trajectory keyframe_poses(const Map& map, PartId part);

/// Keyframes as a TUM trajectory: the poses of the largest part, then those of the other parts, each in its
/// own world, as comments "# part N: timestamp tx ty tz qx qy qz qw".
[[nodiscard]] std::string keyframes_text(const Map& map);

/// The point landmarks as a PLY file, in the order of their ids: position (world, m), mean viewing direction,
/// id, part, observations.
[[nodiscard]] std::string points_ply(const Map& map);

/// Keyframes with pose, part and time, covisibility (pairs of keyframes and how many landmarks they share)
/// and loop edges.
[[nodiscard]] nlohmann::ordered_json map_graph(const Map& map);

}  // namespace ipl_slam
