#include "map/map_file.hpp"

#include <algorithm>
#include <filesystem>
#include <new>

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

#include "common/atomic_file.hpp"
#include "common/text_file.hpp"
#include "map/map_bytes.hpp"

namespace ipl_slam {

void save_map(const std::filesystem::path& file, const Map& map, const Camera& camera) {
  write_file_atomically(file, encode_map(map, camera));
}

SavedMap load_map(const std::filesystem::path& file) {
  try {
    // The head first: something large that is no map need not be read as a whole.
    std::error_code error;
    const std::string head = read_file(file, kSectionedHead);
    const std::uintmax_t size = std::filesystem::file_size(file, error);
    check_head(map_format(), head, error ? head.size() : size);
    return decode_map(read_file(file));
  } catch (const FormatError& error) {
    throw UserError(fmt::format("'{}' {}", file.string(), error.what()));
  } catch (const std::bad_alloc&) {
    throw UserError(fmt::format("'{}' does not fit into this machine's memory", file.string()));
  }
}

}  // namespace ipl_slam
