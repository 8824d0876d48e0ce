#include "dense/surface_extractor.hpp"

#include <algorithm>
#include <set>
#include <tuple>

#include <gtest/gtest.h>

#include "common/random.hpp"
#include "dense/analytic_grid.hpp"

namespace ipl_slam {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

// Distances are kept in steps of truncation / 1024 = 0.04 mm; a point is found from one to seven of them.
constexpr double kRounding = 1e-4;

// A square piece of a plane through the origin, and how far the points cover it: the distance from places on
// it to the nearest point.
double widest_gap(const std::vector<SurfacePoint>& points, const Vector3d& normal, double half) {
  const Vector3d n = normal.normalized();
  const Vector3d a = n.unitOrthogonal(), b = n.cross(a);
  double widest = 0.0;
  for (double s = -half; s <= half; s += 0.4 * kVoxel) {
    for (double t = -half; t <= half; t += 0.4 * kVoxel) {
      const Vector3f place = (s * a + t * b).cast<float>();
      double nearest = 1.0;
      for (const SurfacePoint& p : points) {
        nearest = std::min<double>(nearest, (p.position - place).squaredNorm());
      }
      widest = std::max(widest, std::sqrt(nearest));
    }
  }
  return widest;
}

TEST(SurfaceExtractor, CoversAPlaneWhateverItsSlantAndPlace) {
  const std::vector<std::pair<Vector3d, double>> cases{
      {{0, 0, 1}, 0.0}, {{0, 0, 1}, 0.005},        {{0, -1, 0}, 0.0032},  {{1, 1, 0}, 0.0},
      {{1, 1, 1}, 0.0}, {{0.3, -0.8, 0.5}, 0.002}, {{0.1, 0.05, 1}, 0.0}, {{-1, 0.45, 0.4}, 0.001}};
  for (const auto& [normal, offset] : cases) {
    SCOPED_TRACE(testing::Message() << normal.transpose() << " offset " << offset);
    VoxelGrid grid(kVoxel);
    fill(grid, {-24, -24, -24}, {23, 23, 23}, plane(normal, offset));
    const std::vector<SurfacePoint> points = extract_surface(grid, kTruncation, {});

    std::set<VoxelCoord> voxels;
    std::size_t inner = 0;  // points in a square of 20 x 20 voxels
    const Vector3d n = normal.normalized(), a = n.unitOrthogonal(), b = n.cross(a);
    for (const SurfacePoint& p : points) {
      EXPECT_NEAR(n.dot(p.position.cast<double>()), offset, kRounding);
      EXPECT_NEAR(n.dot(p.normal.cast<double>()), 1.0, 1e-3);
      voxels.insert(p.voxel);
      const Vector3d q = p.position.cast<double>();
      inner += std::abs(a.dot(q)) < 0.1 && std::abs(b.dot(q)) < 0.1 ? 1 : 0;
    }
    EXPECT_EQ(voxels.size(), points.size());
    // A voxel's centre lies no further than half its diagonal from its point.
    EXPECT_LT(widest_gap(points, normal, 0.1), kVoxel * 1.01);
    // One point per voxel the plane passes along its main axis is 1 per area, and 1.73 along the diagonal;
    // what overhangs adds to that.
    EXPECT_GE(inner, 380U);
    EXPECT_LE(inner, 900U);
  }
}

TEST(SurfaceExtractor, LeavesNoHolesInNoise) {
  // Between two layers of voxels noise decides in which of them either finds the surface.
  VoxelGrid grid(kVoxel);
  fill(grid, {0, 0, -5}, {39, 39, 5}, plane({0, 0, 1}, 0.0));
  Random random(7);
  for (const BlockCoord& place : grid.sorted()) {
    VoxelBlock& block = *grid.find(place);
    for (std::size_t i = 0; i < VoxelBlock::kVoxels; ++i) {
      const double noise = random.normal(0.0, 0.001 / kTruncation * VoxelBlock::kDistanceSteps);
      if (block.weight[i] > 0) block.distance[i] += kSeen * static_cast<std::int32_t>(std::lround(noise));
    }
  }
  std::set<std::pair<int, int>> columns;
  for (const SurfacePoint& p : extract_surface(grid, kTruncation, {})) {
    columns.emplace(p.voxel.x, p.voxel.y);
    EXPECT_NEAR(p.position.z(), 0.0, 0.005);  // five standard deviations
  }
  EXPECT_GE(columns.size(), 40U * 40U * 99 / 100);
}

TEST(SurfaceExtractor, FindsASphereWithNormalsOutwards) {
  VoxelGrid grid(kVoxel);
  const Vector3d centre(0.013, -0.021, 0.5);
  fill(grid, {-30, -30, 20}, {30, 30, 80}, sphere(centre, 0.2));
  const std::vector<SurfacePoint> points = extract_surface(grid, kTruncation, {});
  ASSERT_GT(points.size(), 4000U);
  for (const SurfacePoint& p : points) {
    const Vector3d out = p.position.cast<double>() - centre;
    EXPECT_NEAR(out.norm(), 0.2, 3e-4);  // central differences over a curve of 20 voxels: h^2 / 6 r^2
    EXPECT_GT(p.normal.cast<double>().dot(out.normalized()), 0.999);
  }
}

TEST(SurfaceExtractor, FindsAllSidesOfABox) {
  VoxelGrid grid(kVoxel);
  fill(grid, {-30, -30, -30}, {29, 29, 29}, box({0.1, 0.15, 0.2}));
  const std::vector<SurfacePoint> points = extract_surface(grid, kTruncation, {});
  std::array<int, 6> sides{};
  for (const SurfacePoint& p : points) {
    EXPECT_LT(std::abs(box({0.1, 0.15, 0.2})(p.position.cast<double>())), 0.3 * kVoxel);  // edges are rounded
    for (int side = 0; side < 6; ++side) {
      if ((side % 2 == 0 ? 1.0F : -1.0F) * p.normal[side / 2] > 0.99F)
        ++sides[static_cast<std::size_t>(side)];
    }
  }
  const std::array<int, 3> areas{30 * 40, 20 * 40, 20 * 30};  // voxels
  for (int side = 0; side < 6; ++side) {
    const int area = areas[static_cast<std::size_t>(side / 2)];
    EXPECT_NEAR(sides[static_cast<std::size_t>(side)], area, 0.15 * area) << side;  // less the edges
  }
}

TEST(SurfaceExtractor, SkipsWhatWasHardlySeenOrIsLookedThrough) {
  VoxelGrid grid(kVoxel);
  SurfaceOptions options;
  options.min_weight = 3.0;
  fill(grid, {0, 0, -5}, {47, 31, 5}, plane({0, 0, 1}, 0.002));
  fill(grid, {48, 0, -5}, {63, 31, 5}, plane({0, 0, 1}, 0.002), 2);
  for (const BlockCoord& place : grid.sorted()) {
    VoxelBlock& block = *grid.find(place);
    const int through = place.x < 2 ? 0 : place.x < 4 ? kSeen / 2 : place.x < 6 ? kSeen / 2 + 1 : 0;
    block.free.fill(static_cast<std::uint16_t>(through));
  }
  const auto points = extract_surface(grid, kTruncation, options);
  EXPECT_EQ(points.size(), 32U * 32U);
  for (const SurfacePoint& p : points) EXPECT_LT(p.voxel.x, 32);

  options.carve = 1.0;
  EXPECT_EQ(extract_surface(grid, kTruncation, options).size(), 48U * 32U);
  options.min_weight = 2.0;
  EXPECT_EQ(extract_surface(grid, kTruncation, options).size(), 64U * 32U);
}

TEST(SurfaceExtractor, SeesNoSurfaceInTheGapBetweenTwo) {
  // A view of a near thing before a far one leaves distances of about +truncation beside such of -truncation.
  VoxelGrid grid(kVoxel);
  for (int z = 0; z < 16; ++z) {
    for (int y = 0; y < 16; ++y) {
      for (int x = 0; x < 16; ++x) set_voxel(grid, {x, y, z}, x < 8 ? 0.03 : -0.03);
    }
  }
  EXPECT_TRUE(extract_surface(grid, kTruncation, {}).empty());
}

TEST(SurfaceExtractor, DropsSpecksAndKeepsThinThings) {
  VoxelGrid grid(kVoxel);
  fill(grid, {0, 0, -5}, {5, 5, 5}, plane({0, 0, 1}, 0.002));       // 36 points
  fill(grid, {20, -20, -5}, {20, 29, 5}, plane({0, 0, 1}, 0.002));  // 50 points in a row: x has no neighbours
  fill(grid, {30, -20, -5}, {31, 3, 5}, plane({0, 0, 1}, 0.002));   // 48 points, over two blocks
  const auto points = extract_surface(grid, kTruncation, {});
  EXPECT_EQ(points.size(), 48U);
  SurfaceOptions options;
  options.min_component = 36;
  EXPECT_EQ(extract_surface(grid, kTruncation, options).size(), 48U + 36U);
}

TEST(SurfaceExtractor, GivesTheSameWhateverTheOrderOfBlocks) {
  VoxelGrid grid(kVoxel), other(kVoxel);
  fill(grid, {-24, -24, -24}, {23, 23, 23}, plane({0.3, -0.8, 0.5}, 0.002));
  const std::vector<BlockCoord> places = grid.sorted();
  for (auto it = places.rbegin(); it != places.rend(); ++it) other.make(*it) = *grid.find(*it);
  const auto a = extract_surface(grid, kTruncation, {}), b = extract_surface(other, kTruncation, {});
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].voxel, b[i].voxel);
    EXPECT_EQ(a[i].position, b[i].position);
    EXPECT_EQ(a[i].normal, b[i].normal);
  }
  const auto key = [](const SurfacePoint& p) {
    return std::make_pair(VoxelGrid::block_of(p.voxel), VoxelGrid::index_in_block(p.voxel));
  };
  EXPECT_TRUE(
      std::is_sorted(a.begin(), a.end(), [&](const auto& p, const auto& q) { return key(p) < key(q); }));
}

}  // namespace
}  // namespace ipl_slam
