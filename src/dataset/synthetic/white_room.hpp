#pragma once

#include <cstdint>

#include "dataset/synthetic/scene.hpp"

namespace ipl_slam::synthetic {

/// An empty, freshly painted room of 6 x 5 x 2.6 m: plain walls and panels, a rail along them, a door, a
/// window with its blind down, a sideboard, a board on the wall and a counter in the middle. Long straight
/// edges, hardly any corners, no texture. Nothing in it moves.
[[nodiscard]] Scene make_white_room(std::uint64_t seed);

}  // namespace ipl_slam::synthetic
