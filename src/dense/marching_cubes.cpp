#include "dense/marching_cubes.hpp"

#include <cmath>
#include <limits>
#include <utility>

#include "common/union_find.hpp"
#include "dense/block_bits.hpp"
#include "dense/sdf_patch.hpp"

namespace ipl_slam {
namespace {

// An edge of the grid goes from a voxel's centre to the next along an axis.
constexpr int kAxes = 3;
// A cube that the surface cuts can have its least voxel far from it.
constexpr float kAnyDistance = std::numeric_limits<float>::infinity();

using EdgeSet = BlockBits<kAxes * VoxelBlock::kVoxels>;

// A cube of eight voxels that the surface cuts; named by the least of them.
struct Cube {
  std::uint32_t block;
  std::uint8_t x, y, z, inside;
};

Eigen::Vector3i corner_step(int corner) {
  return {corner & 1, corner >> 1 & 1, corner >> 2};
}

class Mesher {
 public:
  Mesher(const VoxelGrid& grid, double truncation, const SurfaceOptions& options)
      : grid_(grid),
        options_(options),
        patch_(grid, truncation, options),
        steepest_(static_cast<float>(1.0 / options.min_gradient)),
        edges_(grid.sorted()) {}

  TriangleMesh run() {
    for (std::uint32_t block = 0; block < edges_.places().size(); ++block) find_cubes(block);
    mesh_.vertices.resize(edges_.number());
    for (std::size_t i = 0; i < cubes_.size(); ++i) {
      if (i == 0 || cubes_[i].block != cubes_[i - 1].block) enter_block(cubes_[i].block);
      add_triangles(cubes_[i]);
    }
    drop_small_parts();
    return std::move(mesh_);
  }

 private:
  void find_cubes(std::uint32_t block) {
    if (!patch_.load(edges_.places()[block], kAnyDistance)) return;
    bool entered = false;
    for (int z = 0; z < VoxelBlock::kSide; ++z) {
      for (int y = 0; y < VoxelBlock::kSide; ++y) {
        for (int x = 0; x < VoxelBlock::kSide; ++x) {
          const unsigned inside = inside_corners(SdfPatch::index(x, y, z));
          if (inside == 0) continue;
          if (!entered) around_ = edges_.neighbours(block);
          entered = true;
          cubes_.push_back({block, static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(y),
                            static_cast<std::uint8_t>(z), static_cast<std::uint8_t>(inside)});
          for_each_cut(cubes_.back(), [&](std::size_t, std::uint32_t holder, std::size_t bit) {
            edges_.insert(holder, bit);
          });
        }
      }
    }
  }

  // Bit c is set where corner c lies behind the surface; 0 where the surface does not cut the cube, something
  // of it is not known, or there is a gap between two surfaces instead of one.
  [[nodiscard]] unsigned inside_corners(int at) const {
    unsigned inside = 0;
    for (int c = 0; c < 8; ++c) {
      const float d = patch_[corner(at, c)];
      if (std::isnan(d)) return 0;
      if (d < 0.0F) inside |= 1U << c;
    }
    if (inside == 0xFFU) return 0;
    for (std::size_t e = 0; e < 12; ++e) {
      if ((cube_case(inside).cut >> e & 1U) == 0) continue;
      const auto [low, high] = ends(at, e);
      if (std::abs(patch_[high] - patch_[low]) > steepest_) return 0;
    }
    return inside;
  }

  [[nodiscard]] static int corner(int at, int c) {
    const Eigen::Vector3i s = corner_step(c);
    return at + s.x() * SdfPatch::kSteps[0] + s.y() * SdfPatch::kSteps[1] + s.z() * SdfPatch::kSteps[2];
  }
  [[nodiscard]] static std::pair<int, int> ends(int at, std::size_t edge) {
    const CubeEdge& e = cube_edges()[edge];
    const int low = corner(at, e.corner);
    return {low, low + SdfPatch::kSteps[e.axis]};
  }

  // Calls visit(edge of the cube, block, bit) for each edge that is cut; it is known in the grid by the last
  // two.
  template <class Visit>
  void for_each_cut(const Cube& cube, Visit visit) const {
    constexpr int kMask = VoxelBlock::kSide - 1;
    const unsigned cut = cube_case(cube.inside).cut;
    for (std::size_t e = 0; e < 12; ++e) {
      if ((cut >> e & 1U) == 0) continue;
      const Eigen::Vector3i v = Eigen::Vector3i(cube.x, cube.y, cube.z) + corner_step(cube_edges()[e].corner);
      const std::size_t voxel = VoxelBlock::index(v.x() & kMask, v.y() & kMask, v.z() & kMask);
      visit(e, EdgeSet::holder(around_, v.x(), v.y(), v.z()), kAxes * voxel + cube_edges()[e].axis);
    }
  }

  void enter_block(std::uint32_t block) {
    patch_.load(edges_.places()[block], kAnyDistance);
    around_ = edges_.neighbours(block);
  }

  void add_triangles(const Cube& cube) {
    std::array<std::uint32_t, 12> vertices{};
    for_each_cut(cube, [&](std::size_t e, std::uint32_t holder, std::size_t bit) {
      vertices[e] = edges_.number_of(holder, bit);
      mesh_.vertices[vertices[e]] = cut_point(cube, e);
    });
    for (const auto& [a, b, c] : cube_case(cube.inside).triangles) {
      mesh_.triangles.push_back({vertices[a], vertices[b], vertices[c]});
    }
  }

  // Where the distance is 0 between the ends of an edge: the same from every cube around it, to the bit.
  [[nodiscard]] Eigen::Vector3f cut_point(const Cube& cube, std::size_t edge) const {
    constexpr int kSide = VoxelBlock::kSide;
    const BlockCoord& place = edges_.places()[cube.block];
    const Eigen::Vector3i s = corner_step(cube_edges()[edge].corner);
    const auto [low, high] = ends(SdfPatch::index(cube.x, cube.y, cube.z), edge);
    Eigen::Vector3d point = grid_.centre({place.x * kSide + cube.x + s.x(), place.y * kSide + cube.y + s.y(),
                                          place.z * kSide + cube.z + s.z()});
    const float share = patch_[low] / (patch_[low] - patch_[high]);
    point[cube_edges()[edge].axis] += grid_.voxel_size() * static_cast<double>(share);
    return point.cast<float>();
  }

  void drop_small_parts() {
    UnionFind parts(mesh_.vertices.size());
    for (const auto& [a, b, c] : mesh_.triangles) {
      parts.join(a, b);
      parts.join(a, c);
    }
    std::vector<int> sizes(mesh_.vertices.size(), 0);
    for (const auto& triangle : mesh_.triangles) ++sizes[parts.find(triangle[0])];

    std::vector<std::uint32_t> renumbered(mesh_.vertices.size());
    std::uint32_t kept = 0;
    for (std::uint32_t v = 0; v < mesh_.vertices.size(); ++v) {
      renumbered[v] = kept;
      if (is_large(sizes[parts.find(v)])) mesh_.vertices[kept++] = mesh_.vertices[v];
    }
    mesh_.vertices.resize(kept);
    std::erase_if(mesh_.triangles, [&](const auto& t) { return !is_large(sizes[parts.find(t[0])]); });
    for (auto& triangle : mesh_.triangles) {
      for (std::uint32_t& v : triangle) v = renumbered[v];
    }
  }
  [[nodiscard]] bool is_large(int triangles) const { return triangles >= 2 * options_.min_component; }

  const VoxelGrid& grid_;
  const SurfaceOptions& options_;
  SdfPatch patch_;
  float steepest_;                // change of the distance along an edge that one surface can make, in voxels
  EdgeSet edges_;                 // that are cut
  EdgeSet::Neighbours around_{};  // the block in patch_
  std::vector<Cube> cubes_;
  TriangleMesh mesh_;
};

}  // namespace

TriangleMesh extract_mesh(const VoxelGrid& grid, double truncation, const SurfaceOptions& options) {
  return Mesher(grid, truncation, options).run();
}

}  // namespace ipl_slam
