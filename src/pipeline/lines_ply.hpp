#pragma once

#include <string>

#include "map/map.hpp"

namespace ipl_slam {

/// The line landmarks of a map as a PLY file (docs/formats.md): two vertices a line, joined by an edge, in
/// the order of their ids; world frame, metres. Text, so that every viewer and ten lines of any language read
/// it.
[[nodiscard]] std::string lines_ply(const Map& map);

}  // namespace ipl_slam
