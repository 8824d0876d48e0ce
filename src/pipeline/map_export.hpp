#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "dataset/trajectory.hpp"
#include "map/map_file.hpp"

namespace ipl_slam {

/// What `ipl_slam map info` says of a map: version, camera, counts, extent (m) and time span (s) of its
/// parts.
[[nodiscard]] nlohmann::ordered_json map_summary(const SavedMap& saved);

/// The poses of the keyframes from `first` on, in order of id, part by part, the part with most of them
/// first.
[[nodiscard]] std::vector<TrajectoryPart> keyframe_parts(const Map& map, KeyframeId first = KeyframeId{0});

/// The point landmarks as a PLY file, in the order of their ids: position (world, m), mean viewing direction,
/// id, part, observations.
[[nodiscard]] std::string points_ply(const Map& map);

/// Keyframes with pose, part and time, covisibility (pairs of keyframes and how many landmarks they share)
/// and loop edges.
[[nodiscard]] nlohmann::ordered_json map_graph(const Map& map);

}  // namespace ipl_slam
