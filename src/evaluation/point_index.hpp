#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include <Eigen/Core>

namespace ipl_slam {

/// Finds points near a place.
class PointIndex {
 public:
  /// radius: up to which distances are asked for, m.
  explicit PointIndex(double radius) : radius_(radius) {}

  void add(const Eigen::Vector3f& point);
  /// Adds a point unless there is one within `spacing` (m, at most the radius) of it.
  void add_apart(const Eigen::Vector3f& point, double spacing);
  /// Distance to the nearest point, m; infinite where none is within the radius.
  [[nodiscard]] double distance(const Eigen::Vector3f& point) const;
  [[nodiscard]] std::size_t size() const { return size_; }
  /// All of them, in no order that means anything.
  template <class Function>
  void for_each(const Function& fn) const {
    for (const auto& [cell, points] : cells_) {
      for (const Eigen::Vector3f& p : points) fn(p);
    }
  }

 private:
  using Cell = std::uint64_t;

  [[nodiscard]] Cell cell_of(const Eigen::Vector3f& point, int dx, int dy, int dz) const;

  double radius_;
  std::size_t size_ = 0;
  std::unordered_map<Cell, std::vector<Eigen::Vector3f>> cells_;  // of the radius's size
};

}  // namespace ipl_slam
