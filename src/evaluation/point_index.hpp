#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include <Eigen/Core>

namespace ipl_slam {

/// Finds the nearest of many points in space.
class PointIndex {
 public:
  /// radius: up to which points are found, m. cell: edge of the cells the points are sorted into, m.
  explicit PointIndex(double radius, double cell = 0.02);

  /// Points are numbered 0, 1, 2, ... in the order they are added.
  void add(const Eigen::Vector3f& point);

  struct Neighbour {
    std::uint32_t number = 0;
    double distance = 0.0;  ///< m
  };
  /// Nothing where no point is within the radius.
  [[nodiscard]] std::optional<Neighbour> nearest(const Eigen::Vector3f& point) const;
  [[nodiscard]] bool any_within(const Eigen::Vector3f& point, double distance) const;

  [[nodiscard]] const std::vector<Eigen::Vector3f>& points() const { return points_; }

 private:
  using Cell = std::uint64_t;

  [[nodiscard]] std::optional<Neighbour> nearest(const Eigen::Vector3f& point, double radius) const;

  double radius_, cell_;
  std::vector<Eigen::Vector3f> points_;
  std::unordered_map<Cell, std::vector<std::uint32_t>> cells_;
};

}  // namespace ipl_slam
