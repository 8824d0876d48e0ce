#include "evaluation/point_index.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

namespace ipl_slam {
namespace {

using Place = std::array<std::int64_t, 3>;

Place place_of(const Eigen::Vector3f& point, double cell) {
  Place place{};
  for (int axis = 0; axis < 3; ++axis) {
    place[static_cast<std::size_t>(axis)] =
        static_cast<std::int64_t>(std::floor(static_cast<double>(point[axis]) / cell));
  }
  return place;
}

// 21 bits an axis: 2 million cells, far more than any room has.
std::uint64_t key_of(const Place& place) {
  constexpr std::int64_t kMiddle = 1 << 20;
  const auto bits = [](std::int64_t v) { return static_cast<std::uint64_t>(v + kMiddle) & 0x1FFFFFU; };
  return bits(place[0]) << 42U | bits(place[1]) << 21U | bits(place[2]);
}

}  // namespace

PointIndex::PointIndex(double radius, double cell) : radius_(radius), cell_(cell) {}

void PointIndex::add(const Eigen::Vector3f& point) {
  cells_[key_of(place_of(point, cell_))].push_back(static_cast<std::uint32_t>(points_.size()));
  points_.push_back(point);
}

std::optional<PointIndex::Neighbour> PointIndex::nearest(const Eigen::Vector3f& point) const {
  return nearest(point, radius_);
}

bool PointIndex::any_within(const Eigen::Vector3f& point, double distance) const {
  return nearest(point, distance).has_value();
}

// Shell by shell of cells around the point's own: what shell s holds is s - 1 cells away or more.
std::optional<PointIndex::Neighbour> PointIndex::nearest(const Eigen::Vector3f& point, double radius) const {
  const Place middle = place_of(point, cell_);
  const int shells = static_cast<int>(std::ceil(radius / cell_));
  std::optional<Neighbour> best;
  for (int s = 0; s <= shells; ++s) {
    if (best && best->distance <= (s - 1) * cell_) break;
    for (int dx = -s; dx <= s; ++dx) {
      for (int dy = -s; dy <= s; ++dy) {
        const bool on_side = std::abs(dx) == s || std::abs(dy) == s;
        for (int dz = -s; dz <= s; dz += on_side || s == 0 ? 1 : 2 * s) {
          const auto it = cells_.find(key_of({middle[0] + dx, middle[1] + dy, middle[2] + dz}));
          if (it == cells_.end()) continue;
          for (const std::uint32_t number : it->second) {
            const double distance = static_cast<double>((points_[number] - point).norm());
            if (distance <= radius && (!best || distance < best->distance)) best = {number, distance};
          }
        }
      }
    }
  }
  return best;
}

}  // namespace ipl_slam
