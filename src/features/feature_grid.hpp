#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "features/features.hpp"

namespace ipl_slam {

/// Finds the keypoints near an undistorted pixel. Cells lie flat in one array, so building takes one counting
/// pass over the keypoints and a query reads neighbouring memory.
class FeatureGrid {
 public:
  /// Covers exactly the undistorted keypoints' bounding box. `cell_size` in pixels, > 0.
  explicit FeatureGrid(const Features& features, float cell_size = 16.0F);

  /// Calls fn(index) for every keypoint with min_level <= level <= max_level whose undistorted pixel lies
  /// within `radius` of (u, v): cell by cell, in a fixed order.
  template <class Function>
  void for_each_in_radius(float u, float v, float radius, int min_level, int max_level, Function&& fn) const {
    // The comparison also turns away NaN.
    if (entries_.empty() || !(radius >= 0.0F) || !std::isfinite(u) || !std::isfinite(v)) return;
    const int first_column = column_of(u - radius), last_column = column_of(u + radius);
    const int first_row = row_of(v - radius), last_row = row_of(v + radius);
    for (int row = first_row; row <= last_row; ++row) {
      // Cells of one row follow one another, so the window's part of a row is one range.
      const std::uint32_t begin = starts_[cell(first_column, row)];
      const std::uint32_t end = starts_[cell(last_column, row) + 1];
      for (std::uint32_t i = begin; i < end; ++i) {
        const Entry& e = entries_[i];
        const float du = e.u - u, dv = e.v - v;
        if (du * du + dv * dv > radius * radius || e.level < min_level || e.level > max_level) continue;
        fn(e.index);
      }
    }
  }

 private:
  struct Entry {
    float u, v;
    int level, index;
  };

  [[nodiscard]] int clamp_cell(float position, int count) const {
    // Clamped before the conversion: far outside, the number may not fit an int.
    return static_cast<int>(std::clamp(position / cell_size_, 0.0F, static_cast<float>(count - 1)));
  }
  [[nodiscard]] int column_of(float u) const { return clamp_cell(u - left_, columns_); }
  [[nodiscard]] int row_of(float v) const { return clamp_cell(v - top_, rows_); }
  [[nodiscard]] std::size_t cell(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }

  float cell_size_;
  float left_ = 0.0F, top_ = 0.0F;
  int columns_ = 0, rows_ = 0;
  std::vector<std::uint32_t> starts_;  // entries of cell i: [starts_[i], starts_[i + 1])
  std::vector<Entry> entries_;
};

}  // namespace ipl_slam
