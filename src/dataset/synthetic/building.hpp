#pragma once

#include "dataset/synthetic/passers_by.hpp"
#include "dataset/synthetic/scene.hpp"

namespace ipl_slam::synthetic {

/// Eight furnished rooms of 6.8 x 6.3 x 2.7 m in a ring about a closed block, joined by doorways; walls,
/// floors, pictures and furniture differ in each and follow from the seed. The site's loop goes through all
/// of them.
[[nodiscard]] Scene make_building(const PassersBy& people);

}  // namespace ipl_slam::synthetic
