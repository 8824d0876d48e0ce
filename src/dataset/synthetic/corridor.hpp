#pragma once

#include <cstdint>

#include "dataset/synthetic/scene.hpp"

namespace ipl_slam::synthetic {

/// A freshly painted corridor of 20 x 2.2 x 2.5 m along x: plain walls, doors of full height on both sides
/// and at one end, a window at the other, skirting boards, beams across the ceiling. Long straight edges,
/// hardly any corners, no texture; its far end is beyond a depth camera's range. Nothing in it moves.
[[nodiscard]] Scene make_corridor(std::uint64_t seed);

}  // namespace ipl_slam::synthetic
