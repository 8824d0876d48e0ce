#pragma once

#include <cstdint>

namespace ipl_slam {

/// Resident memory of this process in bytes; 0 where the system does not tell.
struct ProcessMemory {
  std::uint64_t current = 0;  ///< now
  std::uint64_t peak = 0;     ///< the most it ever was
};

[[nodiscard]] ProcessMemory process_memory();

}  // namespace ipl_slam
