#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>

#include "dense/marching_cubes.hpp"

namespace ipl_slam {
namespace {

constexpr double kReach = 2.0;  // voxels
constexpr Rgb kNoColor{128, 128, 128};

// Points by the cell they lie in. A cell is as wide as a ball of the reach, which so touches two of them per
// axis at most.
class PointCells {
 public:
  PointCells(const std::vector<CloudPoint>& points, float reach) : points_(points), reach_(reach) {
    order_.reserve(points.size());
    for (std::uint32_t i = 0; i < points.size(); ++i) order_.emplace_back(cell_of(points[i].position), i);
    std::sort(order_.begin(), order_.end());
    for (std::size_t i = 0; i < order_.size(); ++i) {
      if (i == 0 || order_[i].first != order_[i - 1].first) first_[order_[i].first] = i;
    }
  }

  // Null if none is within reach; of equally near ones the first.
  [[nodiscard]] const CloudPoint* nearest(const Eigen::Vector3f& to) const {
    const CloudPoint* best = nullptr;
    float best_distance2 = reach_ * reach_;
    const Eigen::Vector3f spread = Eigen::Vector3f::Constant(reach_);
    const Cell low = cell_of(to - spread), high = cell_of(to + spread);
    for (std::int32_t z = low.z; z <= high.z; ++z) {
      for (std::int32_t y = low.y; y <= high.y; ++y) {
        for (std::int32_t x = low.x; x <= high.x; ++x) {
          const auto it = first_.find({x, y, z});
          if (it == first_.end()) continue;
          for (std::size_t i = it->second; i < order_.size() && order_[i].first == it->first; ++i) {
            const CloudPoint& point = points_[order_[i].second];
            const float distance2 = (point.position - to).squaredNorm();
            if (distance2 > best_distance2 || (distance2 == best_distance2 && best != nullptr)) continue;
            best = &point;
            best_distance2 = distance2;
          }
        }
      }
    }
    return best;
  }

 private:
  using Cell = VoxelCoord;
  [[nodiscard]] Cell cell_of(const Eigen::Vector3f& p) const {
    const Eigen::Vector3i c = (p / (2.0F * reach_)).array().floor().cast<int>();
    return {c.x(), c.y(), c.z()};
  }

  const std::vector<CloudPoint>& points_;
  float reach_;
  std::vector<std::pair<Cell, std::uint32_t>> order_;       // points by cell
  std::unordered_map<Cell, std::size_t, PlaceHash> first_;  // of a cell in order_
};

}  // namespace

void color_mesh(TriangleMesh& mesh, const SemanticCloud& cloud, double voxel) {
  const PointCells cells(cloud.points, static_cast<float>(kReach * voxel));
  mesh.colors.clear();
  mesh.colors.reserve(mesh.vertices.size());
  for (const Eigen::Vector3f& vertex : mesh.vertices) {
    const CloudPoint* point = cells.nearest(vertex);
    mesh.colors.push_back(point != nullptr ? point->color : kNoColor);
  }
}

}  // namespace ipl_slam
