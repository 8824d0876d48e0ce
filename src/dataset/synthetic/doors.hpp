#pragma once

#include "dataset/synthetic/passers_by.hpp"
#include "dataset/synthetic/scene.hpp"

namespace ipl_slam::synthetic {

/// A ring of office corridors, 21 x 12 m along its middle, 2.4 m wide, in which the same thing comes again
/// every 3 m: door, door plate, wall paper, lamp, floor covering. What tells places apart is little: stains
/// on the floor, and a notice board, a plant or a bin here and there, as the seed says. The site's loop goes
/// once round.
[[nodiscard]] Scene make_doors(const PassersBy& people);

}  // namespace ipl_slam::synthetic
