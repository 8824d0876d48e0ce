#include "features/feature_grid.hpp"

#include <stdexcept>

namespace ipl_slam {

FeatureGrid::FeatureGrid(const Features& features, float cell_size) : cell_size_(cell_size) {
  if (!(cell_size > 0.0F)) throw std::invalid_argument("FeatureGrid: the cell size must be positive");
  if (features.keypoints.empty()) return;
  Eigen::Vector2f low = features.keypoints.front().undistorted;
  Eigen::Vector2f high = low;
  for (const Keypoint& k : features.keypoints) {
    low = low.cwiseMin(k.undistorted);
    high = high.cwiseMax(k.undistorted);
  }
  // A strong lens model can throw single points far out; cells that grow with them keep their number bounded,
  // and more so for a handful of points.
  constexpr std::size_t kMostCells = 512, kMostCellsOfNone = 64;
  const auto most_cells = static_cast<float>(std::min(kMostCells, kMostCellsOfNone + features.size()));
  cell_size_ = std::max(cell_size_, (high - low).maxCoeff() / most_cells);
  left_ = low.x();
  top_ = low.y();
  columns_ = static_cast<int>((high.x() - low.x()) / cell_size_) + 1;
  rows_ = static_cast<int>((high.y() - low.y()) / cell_size_) + 1;

  // Counting sort by cell, stable: keypoints of a cell stay in their order.
  const auto cell_of = [this](const Keypoint& k) {
    return cell(column_of(k.undistorted.x()), row_of(k.undistorted.y()));
  };
  starts_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_) + 1, 0);
  for (const Keypoint& k : features.keypoints) ++starts_[cell_of(k) + 1];
  for (std::size_t i = 1; i < starts_.size(); ++i) starts_[i] += starts_[i - 1];
  std::vector<std::uint32_t> next(starts_.begin(), starts_.end() - 1);
  entries_.resize(features.size());
  for (std::size_t i = 0; i < features.size(); ++i) {
    const Keypoint& k = features.keypoints[i];
    entries_[next[cell_of(k)]++] = {k.undistorted.x(), k.undistorted.y(), k.level, static_cast<int>(i)};
  }
}

}  // namespace ipl_slam
