#pragma once

#include <string>
#include <string_view>

#include "common/sectioned_bytes.hpp"
#include "map/map_file.hpp"

namespace ipl_slam {

/// Head and sections of a map file.
[[nodiscard]] const SectionedFormat& map_format();

/// The content of a map file.
[[nodiscard]] std::string encode_map(const Map& map, const Camera& camera);

/// The map that such content holds; encode_map gives the same bytes again. Everything is checked: what comes
/// out is a map like any other, whatever the bytes. Throws FormatError.
[[nodiscard]] SavedMap decode_map(std::string_view bytes);

}  // namespace ipl_slam
