#include "common/fingerprint.hpp"

#include <cstdint>

#include <fmt/format.h>

namespace ipl_slam {

std::string fingerprint(std::string_view content) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (const char c : content) {
    hash ^= static_cast<unsigned char>(c);
    hash *= 0x100000001b3ULL;
  }
  return fmt::format("{:016x}", hash);
}

}  // namespace ipl_slam
