#pragma once

#include <atomic>
#include <map>
#include <optional>
#include <vector>

#include "loop/essential_graph.hpp"
#include "loop/pose_graph.hpp"
#include "map/map.hpp"

namespace ipl_slam {

/// T_cw by keyframe.
using KeyframePoses = std::map<KeyframeId, SE3>;

/// Where the keyframes of a graph come to stand when those of `held` take these poses, all of them known to
/// be right, and the others keep their place relative to each other as well as they can. Includes `held`.
/// Nothing where it was aborted.
[[nodiscard]] std::optional<KeyframePoses> spread_correction(const Map& map,
                                                             const std::vector<EssentialEdge>& edges,
                                                             const KeyframePoses& held,
                                                             const PoseGraphOptions& options,
                                                             const std::atomic<bool>* abort);

/// Moves keyframes, and every landmark along with the keyframe it hangs on: the oldest of `held` that sees
/// it, else the oldest that does. Derived data is refreshed.
void move_keyframes(Map& map, const KeyframePoses& poses, const KeyframePoses& held = {});

}  // namespace ipl_slam
