#include "segmentation/tensor_info.hpp"

#include <fmt/format.h>

namespace ipl_slam {

std::string describe(const TensorInfo& info) {
  std::string sizes;
  for (const std::int64_t size : info.shape) {
    if (!sizes.empty()) sizes += ',';
    sizes += size < 0 ? "?" : std::to_string(size);
  }
  return fmt::format("{} {}[{}]", info.name, info.type, sizes);
}

}  // namespace ipl_slam
