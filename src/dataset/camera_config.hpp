#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "geometry/camera.hpp"

namespace ipl_slam {

/// Names of the built-in cameras: tum1, tum2, tum3 (TUM RGB-D benchmark, freiburg1 to 3) and bonn (Bonn RGB-D
/// Dynamic).
[[nodiscard]] const std::vector<std::string>& camera_presets();

/// A built-in camera by name, or one from a YAML file with the keys
///   width height fx fy cx cy depth_scale     required
///   name k1 k2 p1 p2 k3                      optional: the file's name, no distortion
/// with the meanings and units of Camera. Throws UserError: unknown preset; a file that is missing or no
/// YAML; a key that is unknown (with the nearest valid one), given twice, missing or of the wrong type; a
/// value that cannot be. The message names file and line.
[[nodiscard]] Camera load_camera(const std::string& name_or_file);

/// The text of a camera file, which load_camera reads back as the same camera.
[[nodiscard]] std::string camera_yaml(const Camera& camera);

/// What to give to load_camera for a sequence: the path of camera.yaml where the folder holds one, or a
/// preset told by the folder's name ("freiburg1" or "fr1", ..., "bonn"; the folder above counts where the
/// name itself says nothing).
[[nodiscard]] std::optional<std::string> guess_camera(const std::filesystem::path& folder);

}  // namespace ipl_slam
