#pragma once

#include <filesystem>

#include "geometry/camera.hpp"
#include "map/map.hpp"

namespace ipl_slam {

/// What a map file holds.
struct SavedMap {
  Camera camera;
  Map map;
};

/// Writes a map with all it takes to go on with it, as docs/formats.md describes: beside, then renamed, so
/// that `file` is the old one or the new one whenever the program ends. Ids are counted anew, in their order;
/// instance ids, which mean something within one run only, are left out. Throws UserError where it cannot be
/// written.
void save_map(const std::filesystem::path& file, const Map& map, const Camera& camera);

/// Throws UserError where the file cannot be read, is no map file, is of a newer version, is cut short or
/// damaged.
[[nodiscard]] SavedMap load_map(const std::filesystem::path& file);

}  // namespace ipl_slam
