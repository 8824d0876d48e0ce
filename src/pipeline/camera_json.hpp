#pragma once

#include <nlohmann/json.hpp>

#include "geometry/camera.hpp"

namespace ipl_slam {

/// A camera's parameters under the names they have in a camera file.
[[nodiscard]] nlohmann::ordered_json camera_json(const Camera& camera);

}  // namespace ipl_slam
