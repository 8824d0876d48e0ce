#include "evaluation/point_index.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ipl_slam {

// 21 bits an axis: 2 million cells, far more than any room has.
PointIndex::Cell PointIndex::cell_of(const Eigen::Vector3f& point, int dx, int dy, int dz) const {
  constexpr std::int64_t kMiddle = 1 << 20;
  const auto axis = [&](float value, int offset) {
    const auto cell = static_cast<std::int64_t>(std::floor(static_cast<double>(value) / radius_)) + offset;
    return static_cast<Cell>(cell + kMiddle) & 0x1FFFFFU;
  };
  return axis(point.x(), dx) << 42U | axis(point.y(), dy) << 21U | axis(point.z(), dz);
}

void PointIndex::add(const Eigen::Vector3f& point) {
  cells_[cell_of(point, 0, 0, 0)].push_back(point);
  ++size_;
}

void PointIndex::add_apart(const Eigen::Vector3f& point, double spacing) {
  if (distance(point) > spacing) add(point);
}

double PointIndex::distance(const Eigen::Vector3f& point) const {
  float best = std::numeric_limits<float>::infinity();
  for (int dx = -1; dx <= 1; ++dx) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dz = -1; dz <= 1; ++dz) {
        const auto it = cells_.find(cell_of(point, dx, dy, dz));
        if (it == cells_.end()) continue;
        for (const Eigen::Vector3f& p : it->second) best = std::min(best, (p - point).squaredNorm());
      }
    }
  }
  const double distance = std::sqrt(static_cast<double>(best));
  return distance <= radius_ ? distance : std::numeric_limits<double>::infinity();
}

}  // namespace ipl_slam
