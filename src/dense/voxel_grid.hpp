#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include <Eigen/Core>

namespace ipl_slam {

/// Place of a voxel in the grid; voxel (x, y, z) reaches from (x, y, z) to (x + 1, y + 1, z + 1) voxel sizes.
struct VoxelCoord {
  std::int32_t x = 0, y = 0, z = 0;

  friend auto operator<=>(const VoxelCoord&, const VoxelCoord&) = default;
};

/// Place of a block of voxels, in blocks.
struct BlockCoord {
  std::int32_t x = 0, y = 0, z = 0;

  friend auto operator<=>(const BlockCoord&, const BlockCoord&) = default;
};

/// Mixes the numbers of a place. Any mixing will do: the primes are those of Teschner et al., "Optimized
/// spatial hashing for collision detection of deformable objects", VMV 2003.
struct PlaceHash {
  template <class Place>
  std::size_t operator()(const Place& p) const {
    return static_cast<std::uint32_t>(p.x) * 73856093U ^ static_cast<std::uint32_t>(p.y) * 19349663U ^
           static_cast<std::uint32_t>(p.z) * 83492791U;
  }
};

/// A cube of voxels. All sums are of whole numbers: what was added can be taken out again without a trace,
/// in any order.
struct alignas(32) VoxelBlock {
  static constexpr int kSide = 8;
  static constexpr int kVoxels = kSide * kSide * kSide;
  static constexpr int kDistanceSteps = 1024;  ///< of a truncation distance

  /// Per voxel (x fastest, then y): sum over views of weight x signed distance to the surface in
  /// truncation / kDistanceSteps, positive on the side of the camera.
  std::array<std::int32_t, kVoxels> distance{};
  std::array<std::uint16_t, kVoxels> weight{};  ///< sum of the weights of these views
  std::array<std::uint16_t, kVoxels> free{};    ///< sum of the weights of views that look through the voxel
  std::uint32_t born = 0;                       ///< when it was made, by the clock of who fills the grid
  std::uint32_t claims = 0;                     ///< views that have their surface in it

  [[nodiscard]] static constexpr std::size_t index(int x, int y, int z) {
    return static_cast<std::size_t>((z * kSide + y) * kSide + x);
  }
};

/// A grid of voxels of which only blocks near surfaces exist (Niessner et al., "Real-time 3D reconstruction
/// at scale using voxel hashing", ACM Transactions on Graphics 2013). World frame.
class VoxelGrid {
 public:
  struct Entry {
    BlockCoord place;
    std::unique_ptr<VoxelBlock> block;
  };

  /// voxel_size: edge of a voxel, m.
  explicit VoxelGrid(double voxel_size) : voxel_size_(voxel_size) {}

  [[nodiscard]] double voxel_size() const { return voxel_size_; }
  [[nodiscard]] double block_size() const { return voxel_size_ * VoxelBlock::kSide; }
  [[nodiscard]] Eigen::Vector3d centre(const VoxelCoord& v) const {
    return voxel_size_ * (Eigen::Vector3d(v.x, v.y, v.z).array() + 0.5).matrix();
  }
  /// The voxel that holds a point.
  [[nodiscard]] VoxelCoord voxel_of(const Eigen::Vector3d& point_w) const;
  /// The block that holds a voxel, and the voxel's index in it.
  [[nodiscard]] static BlockCoord block_of(const VoxelCoord& v);
  [[nodiscard]] static std::size_t index_in_block(const VoxelCoord& v);

  /// Null where there is none.
  [[nodiscard]] VoxelBlock* find(const BlockCoord& place);
  [[nodiscard]] const VoxelBlock* find(const BlockCoord& place) const;
  /// The block there, a new empty one if there was none.
  VoxelBlock& make(const BlockCoord& place);
  void erase(const BlockCoord& place);

  /// All there are, in an order that depends on what was made and erased.
  [[nodiscard]] const std::vector<Entry>& blocks() const { return blocks_; }
  /// Where they are, in order.
  [[nodiscard]] std::vector<BlockCoord> sorted() const;
  /// Bytes of memory.
  [[nodiscard]] std::size_t bytes() const;

 private:
  double voxel_size_;
  std::vector<Entry> blocks_;
  std::unordered_map<BlockCoord, std::uint32_t, PlaceHash> index_;  // of blocks_
};

}  // namespace ipl_slam
