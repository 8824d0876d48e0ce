#include "evaluation/benchmark_record.hpp"

#include <cstdint>
#include <string_view>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ipl_slam;
  // A record cut short by an interrupted benchmark is nothing, never an error.
  (void)parse_record(std::string_view(reinterpret_cast<const char*>(data), size));
  return 0;
}
