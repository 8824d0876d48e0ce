#include "common/process_info.hpp"

#include <fstream>
#include <sstream>
#include <string>

namespace ipl_slam {

ProcessMemory process_memory() {
  // Not getrusage(): its maximum is inherited from the program that started this one.
  ProcessMemory memory;
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    std::istringstream words(line);
    std::string key;
    std::uint64_t kibibytes = 0;
    if (!(words >> key >> kibibytes)) continue;
    if (key == "VmRSS:") memory.current = kibibytes * 1024;
    if (key == "VmHWM:") memory.peak = kibibytes * 1024;
  }
  return memory;
}

}  // namespace ipl_slam
