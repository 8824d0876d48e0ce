#include "dense/occupancy_grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace ipl_slam {
namespace {

constexpr double kFarthest = 1 << 20;  // cells from the origin

std::optional<VoxelCoord> place_of(const Eigen::Vector3d& in_cells) {
  if (!(in_cells.cwiseAbs().maxCoeff() < kFarthest)) return std::nullopt;
  const Eigen::Vector3d low = in_cells.array().floor();
  return VoxelCoord{static_cast<std::int32_t>(low.x()), static_cast<std::int32_t>(low.y()),
                    static_cast<std::int32_t>(low.z())};
}

// The walk along a ray, along one axis. Positions in cells, the way counted from 0 to 1.
struct Walk {
  Walk(double from, double to, std::int32_t start)
      : step(to > from ? 1 : -1),
        per_cell(1.0 / std::abs(to - from)),
        next((start + (to > from ? 1 : 0) - from) / (to - from)) {
    if (to == from) next = std::numeric_limits<double>::infinity();
  }
  std::int32_t step;
  double per_cell;  // of the way, from one side of a cell to the other
  double next;      // of the way, at which the next cell begins
};

}  // namespace

OccupancyGrid::OccupancyGrid(const OccupancyOptions& options, const SE3& T_gw)
    : options_(options), T_gw_(T_gw) {
  check_options(options_);
}

void OccupancyGrid::add_points(const std::vector<CloudPoint>& points) {
  for (const CloudPoint& point : points) {
    const auto place = place_of(T_gw_ * point.position.cast<double>() / options_.cell);
    if (!place) continue;
    std::uint16_t& count = blocks_[VoxelGrid::block_of(*place)].points[VoxelGrid::index_in_block(*place)];
    if (count < std::numeric_limits<std::uint16_t>::max()) ++count;
  }
}

void OccupancyGrid::see_through(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d a = from / options_.cell, b = to / options_.cell;
  const auto start = place_of(a), end = place_of(b);
  if (!start || !end) return;
  std::array<std::int32_t, 3> cell{start->x, start->y, start->z};
  std::array<Walk, 3> walks{Walk(a.x(), b.x(), cell[0]), Walk(a.y(), b.y(), cell[1]),
                            Walk(a.z(), b.z(), cell[2])};
  // So many steps lead from the one cell to the other, whatever rounding does.
  int steps = std::abs(end->x - start->x) + std::abs(end->y - start->y) + std::abs(end->z - start->z);
  BlockCoord place = VoxelGrid::block_of(*start);
  Block* block = &blocks_[place];
  while (true) {
    const VoxelCoord here{cell[0], cell[1], cell[2]};
    if (const BlockCoord now = VoxelGrid::block_of(here); now != place) block = &blocks_[place = now];
    block->seen_through[VoxelGrid::index_in_block(here)] = true;
    if (steps-- == 0) return;
    const auto nearest = std::min_element(walks.begin(), walks.end(),
                                          [](const Walk& p, const Walk& q) { return p.next < q.next; });
    cell[static_cast<std::size_t>(nearest - walks.begin())] += nearest->step;
    nearest->next += nearest->per_cell;
  }
}

void OccupancyGrid::add_rays(const RangeImage& view, const Camera& camera, const SE3& T_wc) {
  CV_Assert(view.depth.type() == CV_32FC1 && view.reach.type() == CV_32FC1);
  CV_Assert(view.depth.size() == view.reach.size());
  const SE3 T_gc = T_gw_ * T_wc;
  const Eigen::Vector3d eye = T_gc.translation();
  for (int v = options_.every / 2; v < view.depth.rows; v += options_.every) {
    for (int u = options_.every / 2; u < view.depth.cols; u += options_.every) {
      const float surface = view.depth.at<float>(v, u);
      const Eigen::Vector3d ray = camera.unproject({u, v}, 1.0);
      const double length = ray.norm();  // per metre of depth
      // What was measured may lie as far before its depth as noise goes: a cell.
      const double clear = (surface > 0.0F ? surface : view.reach.at<float>(v, u)) - options_.cell / length;
      const double depth = std::min(clear, options_.max_range / length);
      if (depth > 0.0) see_through(eye, T_gc * (depth * ray));
    }
  }
}

Occupancy OccupancyGrid::state(const Block& block, std::size_t index) const {
  if (block.points[index] >= options_.min_points) return Occupancy::kOccupied;
  return block.seen_through[index] ? Occupancy::kFree : Occupancy::kUnknown;
}

Occupancy OccupancyGrid::at(const Eigen::Vector3d& point_g) const {
  const auto place = place_of(point_g / options_.cell);
  if (!place) return Occupancy::kUnknown;
  const auto block = blocks_.find(VoxelGrid::block_of(*place));
  return block == blocks_.end() ? Occupancy::kUnknown
                                : state(block->second, VoxelGrid::index_in_block(*place));
}

std::vector<OccupancyGrid::Cell> OccupancyGrid::cells() const {
  constexpr int kSide = VoxelBlock::kSide;
  std::vector<Cell> cells;
  for (const auto& [place, block] : blocks_) {
    for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
      const Occupancy occupancy = state(block, static_cast<std::size_t>(i));
      if (occupancy == Occupancy::kUnknown) continue;
      cells.push_back({{place.x * kSide + i % kSide, place.y * kSide + i / kSide % kSide,
                        place.z * kSide + i / (kSide * kSide)},
                       occupancy});
    }
  }
  std::sort(cells.begin(), cells.end(), [](const Cell& a, const Cell& b) { return a.place < b.place; });
  return cells;
}

}  // namespace ipl_slam
