#pragma once

#include <atomic>

#include "loop/place_verifier.hpp"
#include "map/map.hpp"
#include "mapping/landmark_fusion.hpp"
#include "mapping/line_mapping.hpp"

namespace ipl_slam {

/// Corrects the drift that a recognised place reveals: `current`, a keyframe, was found by `match` in its own
/// part of the map. Moves the keyframes around it and their landmarks to where the match says, joins what
/// both sides of the loop saw under two ids, spreads the rest of the error over the essential graph
/// (pose_graph.hpp) and remembers the loop edge. Global bundle adjustment is left to the caller.
void close_loop(Map& map, KeyframeId current, const PlaceMatch& match, const LandmarkFusion& fusion,
                const LineMapping& lines);

/// `current` was found by `match` in another part: the younger part moves into the older one's world, what
/// both saw is joined, and the seam is optimised (welding window, Campos et al., "ORB-SLAM3", T-RO 2021,
/// V-C).
void merge_parts(Map& map, KeyframeId current, const PlaceMatch& match, const LandmarkFusion& fusion,
                 const LineMapping& lines);

}  // namespace ipl_slam
