#include "dense/surface_extractor.hpp"

#include <cmath>
#include <cstdint>

#include "common/union_find.hpp"
#include "dense/block_bits.hpp"
#include "dense/sdf_patch.hpp"

namespace ipl_slam {
namespace {

using VoxelSet = BlockBits<VoxelBlock::kVoxels>;

// Found from a voxel's centre, in units of voxels.
struct Crossing {
  Eigen::Vector3f offset;  // from the voxel's centre
  Eigen::Vector3f normal;
};

// How far outside its voxel a point may lie where the voxel it lies in has none, in voxels. Noise of the
// distances turns gradients, so that each of two neighbours may find the point in the other: a hole.
constexpr float kOverhang = 0.25F;

// How many voxels further the voxel lies that holds a point.
Eigen::Vector3i cell_of(const Eigen::Vector3f& offset) {
  return (offset.array() + 0.5F).floor().cast<int>();
}

// False if a voxel has no neighbour of known distance along an axis.
bool gradient(const SdfPatch& patch, int at, Eigen::Vector3f& g) {
  for (int axis = 0; axis < 3; ++axis) {
    const int step = SdfPatch::kSteps[static_cast<std::size_t>(axis)];
    const float before = patch[at - step], after = patch[at + step];
    if (!std::isnan(before) && !std::isnan(after)) {
      g[axis] = 0.5F * (after - before);
    } else if (!std::isnan(after)) {
      g[axis] = after - patch[at];
    } else if (!std::isnan(before)) {
      g[axis] = patch[at] - before;
    } else {
      return false;
    }
  }
  return true;
}

class Extractor {
 public:
  Extractor(const VoxelGrid& grid, double truncation, const SurfaceOptions& options)
      : grid_(grid),
        options_(options),
        patch_(grid, truncation, options),
        min_gradient_(static_cast<float>(options.min_gradient)),
        reach_(std::sqrt(3.0F) * (0.5F + kOverhang) / min_gradient_) {}

  std::vector<SurfacePoint> run() {
    for (const BlockCoord& place : grid_.sorted()) {
      if (patch_.load(place, reach_)) find_points(place);
    }
    drop([this](const VoxelSet& voxels) { return find_overhanging(voxels); });
    drop([this](const VoxelSet& voxels) { return find_specks(voxels); });
    return std::move(points_);
  }

 private:
  void find_points(const BlockCoord& place) {
    constexpr int kSide = VoxelBlock::kSide;
    Crossing crossing;
    for (int z = 0; z < kSide; ++z) {
      for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
          if (!find_crossing(SdfPatch::index(x, y, z), crossing)) continue;
          const VoxelCoord voxel{place.x * kSide + x, place.y * kSide + y, place.z * kSide + z};
          const Eigen::Vector3d position =
              grid_.centre(voxel) + grid_.voxel_size() * crossing.offset.cast<double>();
          points_.push_back({position.cast<float>(), crossing.normal, voxel});
          offsets_.push_back(crossing.offset);
        }
      }
    }
  }

  bool find_crossing(int at, Crossing& crossing) const {
    const float distance = patch_[at];
    if (!(std::abs(distance) < reach_)) return false;  // also where it is not a number
    Eigen::Vector3f g;
    if (!gradient(patch_, at, g)) return false;
    const float slope = g.norm();
    if (slope < min_gradient_ || slope * min_gradient_ > 1.0F) return false;
    crossing.normal = g / slope;
    crossing.offset = -distance / slope * crossing.normal;
    return crossing.offset.cwiseAbs().maxCoeff() <= 0.5F + kOverhang;
  }

  // Drops the points that a function of the set of their voxels marks.
  template <class FindDropped>
  void drop(FindDropped find_dropped) {
    std::vector<BlockCoord> places;
    for (const SurfacePoint& point : points_) {
      const BlockCoord place = VoxelGrid::block_of(point.voxel);
      if (places.empty() || places.back() != place) places.push_back(place);
    }
    VoxelSet voxels(std::move(places));
    std::uint32_t block = 0;
    for (const SurfacePoint& point : points_) {
      if (VoxelGrid::block_of(point.voxel) != voxels.places()[block]) ++block;
      voxels.insert(block, VoxelGrid::index_in_block(point.voxel));
    }
    voxels.number();
    const std::vector<bool> dropped = find_dropped(voxels);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (dropped[i]) continue;
      points_[kept] = points_[i];
      offsets_[kept++] = offsets_[i];
    }
    points_.resize(kept);
    offsets_.resize(kept);
  }

  // Calls visit(i, around) for every point, where around(step) is the number of the point whose voxel lies
  // that many voxels further, or VoxelSet::kNone.
  template <class Visit>
  void for_each_with_neighbours(const VoxelSet& voxels, Visit visit) const {
    constexpr int kMask = VoxelBlock::kSide - 1;
    std::uint32_t block = VoxelSet::kNone;
    VoxelSet::Neighbours around{};
    for (std::uint32_t i = 0; i < points_.size(); ++i) {
      const VoxelCoord& v = points_[i].voxel;
      if (block == VoxelSet::kNone || voxels.places()[block] != VoxelGrid::block_of(v)) {
        ++block;  // from kNone to 0
        around = voxels.neighbours(block);
      }
      visit(i, [&](const Eigen::Vector3i& step) {
        const int x = (v.x & kMask) + step.x(), y = (v.y & kMask) + step.y(), z = (v.z & kMask) + step.z();
        const std::uint32_t holder = VoxelSet::holder(around, x, y, z);
        const std::size_t bit = VoxelBlock::index(x & kMask, y & kMask, z & kMask);
        const bool there = holder != VoxelSet::kNone && voxels.contains(holder, bit);
        return there ? voxels.number_of(holder, bit) : VoxelSet::kNone;
      });
    }
  }

  // Points outside their voxel where another point was kept already or is sure to be.
  std::vector<bool> find_overhanging(const VoxelSet& voxels) const {
    std::vector<bool> dropped(points_.size(), false);
    for_each_with_neighbours(voxels, [&](std::uint32_t i, const auto& around) {
      const Eigen::Vector3i cell = cell_of(offsets_[i]);
      if (cell.isZero()) return;
      const std::uint32_t other = around(cell);
      if (other == VoxelSet::kNone) return;
      dropped[i] = cell_of(offsets_[other]).isZero() || (other < i && !dropped[other]);
    });
    return dropped;
  }

  std::vector<bool> find_specks(const VoxelSet& voxels) const {
    // Half of the 26 neighbours: the other half has this point as theirs.
    static const std::vector<Eigen::Vector3i> kBefore = [] {
      std::vector<Eigen::Vector3i> steps;
      for (int k = 0; k < 13; ++k) steps.emplace_back(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
      return steps;
    }();
    UnionFind components(points_.size());
    for_each_with_neighbours(voxels, [&](std::uint32_t i, const auto& around) {
      for (const Eigen::Vector3i& step : kBefore) {
        const std::uint32_t other = around(step);
        if (other != VoxelSet::kNone) components.join(i, other);
      }
    });
    std::vector<int> sizes(points_.size(), 0);
    for (std::uint32_t i = 0; i < points_.size(); ++i) ++sizes[components.find(i)];
    std::vector<bool> dropped(points_.size());
    for (std::uint32_t i = 0; i < points_.size(); ++i) {
      dropped[i] = sizes[components.find(i)] < options_.min_component;
    }
    return dropped;
  }

  const VoxelGrid& grid_;
  const SurfaceOptions& options_;
  SdfPatch patch_;
  float min_gradient_;
  float reach_;  // no point is further from its voxel's centre by its distance, in voxels
  std::vector<SurfacePoint> points_;
  std::vector<Eigen::Vector3f> offsets_;  // of the points from their voxels' centres, in voxels
};

}  // namespace

std::vector<SurfacePoint> extract_surface(const VoxelGrid& grid, double truncation,
                                          const SurfaceOptions& options) {
  return Extractor(grid, truncation, options).run();
}

}  // namespace ipl_slam
