#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include "common/ids.hpp"
#include "dynamics/contour_window.hpp"

namespace ipl_slam {

/// The frames in which each instance moved, as spans that came one after the other and may overlap.
class DynamicSpans {
 public:
  void add(const DynamicSpan& span);
  [[nodiscard]] bool contains(InstanceId id, std::size_t frame) const;
  /// In any frame.
  [[nodiscard]] bool contains(InstanceId id) const { return spans_.contains(id); }

 private:
  std::map<InstanceId, std::vector<DynamicSpan>> spans_;  // of one instance: in order of time, apart
};

}  // namespace ipl_slam
