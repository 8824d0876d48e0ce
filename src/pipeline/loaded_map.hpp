#pragma once

#include <filesystem>

#include "geometry/camera.hpp"
#include "map/map.hpp"
#include "pipeline/config.hpp"

namespace ipl_slam {

/// Reads a map file to go on with it. Throws UserError where it cannot be read (map/map_file.hpp), is
/// empty, or was made with another camera or another image pyramid: its landmarks would not be found.
[[nodiscard]] Map load_fitting_map(const std::filesystem::path& file, const Camera& camera,
                                   const Config& config);

}  // namespace ipl_slam
