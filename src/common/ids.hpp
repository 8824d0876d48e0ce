#pragma once

#include <compare>
#include <cstdint>
#include <limits>

namespace ipl_slam {

/// Strongly typed index. Ids replace pointers everywhere: they can be stored, saved and compared, they order
/// in a way that is the same on every run, and a KeyframeId cannot be passed where a PointId is meant.
template <class Tag>
struct Id {
  static constexpr std::uint32_t kInvalid = std::numeric_limits<std::uint32_t>::max();

  std::uint32_t value = kInvalid;

  [[nodiscard]] constexpr bool valid() const { return value != kInvalid; }
  friend constexpr auto operator<=>(const Id&, const Id&) = default;
};

using KeyframeId = Id<struct KeyframeTag>;
using PointId = Id<struct PointTag>;
using LineId = Id<struct LineTag>;
using InstanceId = Id<struct InstanceTag>;
using PartId = Id<struct PartTag>;

}  // namespace ipl_slam
