#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace ipl_slam {

/// What a network declares of one of its inputs or outputs.
struct TensorInfo {
  std::string name;
  std::string type;  ///< of its elements, e.g. "float32", "int64"; "other" for what has no such name
  std::vector<std::int64_t> shape;  ///< -1 where the size is open
};

/// E.g. "images float32[1,3,480,640]"; "?" where the size is open.
[[nodiscard]] std::string describe(const TensorInfo& info);

}  // namespace ipl_slam
