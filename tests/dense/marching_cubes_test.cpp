#include "dense/marching_cubes.hpp"

#include <algorithm>
#include <bit>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "common/random.hpp"
#include "dense/analytic_grid.hpp"

namespace ipl_slam {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

using Edge = std::pair<std::uint32_t, std::uint32_t>;

// How often each side of a triangle is walked, in its direction.
std::map<Edge, int> sides_of(const TriangleMesh& mesh) {
  std::map<Edge, int> sides;
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) ++sides[{t[k], t[(k + 1) % 3]}];
  }
  return sides;
}

void expect_closed(const TriangleMesh& mesh) {
  const std::map<Edge, int> sides = sides_of(mesh);
  for (const auto& [side, count] : sides) {
    EXPECT_EQ(count, 1);
    EXPECT_TRUE(sides.contains({side.second, side.first}));
  }
}

Vector3d area_vector(const TriangleMesh& mesh, std::size_t triangle) {
  const auto corner = [&](std::size_t k) -> Vector3d {
    return mesh.vertices[mesh.triangles[triangle][k]].cast<double>();
  };
  return 0.5 * (corner(1) - corner(0)).cross(corner(2) - corner(0));
}

TEST(CubeCases, CutTheEdgesBetweenInsideAndOutside) {
  for (unsigned inside = 0; inside < 256; ++inside) {
    const CubeCase& c = cube_case(inside);
    std::set<unsigned> used;
    for (const auto& triangle : c.triangles) used.insert(triangle.begin(), triangle.end());
    for (unsigned e = 0; e < 12; ++e) {
      const CubeEdge& edge = cube_edges()[e];
      const unsigned low = edge.corner, high = low | 1U << edge.axis;
      const bool differs = (inside >> low & 1U) != (inside >> high & 1U);
      EXPECT_EQ((c.cut >> e & 1U) != 0, differs);
      EXPECT_EQ(used.contains(e), differs);
    }
  }
}

TEST(CubeCases, OfOneCornerIsATriangleFacingAwayFromIt) {
  const CubeCase& c = cube_case(1);
  ASSERT_EQ(c.triangles.size(), 1U);
  // Cuts along x, y, z from corner 0: in this order, up to the start, they are anticlockwise from outside.
  auto axes = c.triangles[0];
  for (auto& e : axes) e = cube_edges()[e].axis;
  EXPECT_EQ((axes[0] + 1) % 3, axes[1]);
  EXPECT_EQ((axes[1] + 1) % 3, axes[2]);
}

TEST(MarchingCubes, MakeASphereOfASphere) {
  VoxelGrid grid(kVoxel);
  const Vector3d centre(0.013, -0.021, 0.5);
  fill(grid, {-30, -30, 20}, {30, 30, 80}, sphere(centre, 0.2));
  const TriangleMesh mesh = extract_mesh(grid, kTruncation, {});
  expect_closed(mesh);
  const auto edges = static_cast<std::ptrdiff_t>(sides_of(mesh).size() / 2);
  EXPECT_EQ(std::ssize(mesh.vertices) - edges + std::ssize(mesh.triangles), 2);  // Euler
  for (const Vector3f& v : mesh.vertices) {
    EXPECT_NEAR((v.cast<double>() - centre).norm(), 0.2, 2e-4);  // chord of a voxel: h^2 / 8 r, and rounding
  }
  double area = 0.0, outwards = 0.0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Vector3d a = area_vector(mesh, i);
    area += a.norm();
    outwards += a.dot((mesh.vertices[mesh.triangles[i][0]].cast<double>() - centre).normalized());
  }
  const double true_area = 4.0 * M_PI * 0.2 * 0.2;
  EXPECT_NEAR(area, true_area, 0.02 * true_area);
  EXPECT_NEAR(outwards, area, 0.02 * area);
}

TEST(MarchingCubes, MeetAPlane) {
  VoxelGrid grid(kVoxel);
  const Vector3d normal = Vector3d(0.3, -0.8, 0.5).normalized();
  fill(grid, {-24, -24, -24}, {23, 23, 23}, plane(normal, 0.003));
  const TriangleMesh mesh = extract_mesh(grid, kTruncation, {});
  ASSERT_GT(mesh.triangles.size(), 2000U);
  for (const Vector3f& v : mesh.vertices) EXPECT_NEAR(normal.dot(v.cast<double>()), 0.003, 1e-4);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) EXPECT_GE(area_vector(mesh, i).dot(normal), -1e-9);
}

// All 256 cases side by side with all others, ambiguous faces between them.
TEST(MarchingCubes, CloseWhateverIsInsideAndOutside) {
  Random random(3);
  SurfaceOptions options;
  options.min_component = 1;
  for (int trial = 0; trial < 4; ++trial) {
    VoxelGrid grid(kVoxel);
    for (int z = -9; z < 12; ++z) {
      for (int y = -9; y < 12; ++y) {
        for (int x = -9; x < 12; ++x) {
          const bool inner = std::min({x, y, z}) > -9 && std::max({x, y, z}) < 11;
          const double size = random.uniform(0.001, 0.01);
          set_voxel(grid, {x, y, z}, inner && random.uniform(0.0, 1.0) < 0.5 ? -size : size);
        }
      }
    }
    const TriangleMesh mesh = extract_mesh(grid, kTruncation, options);
    ASSERT_GT(mesh.triangles.size(), 10000U);
    expect_closed(mesh);
  }
}

TEST(MarchingCubes, EndWhereNothingIsKnown) {
  VoxelGrid grid(kVoxel);
  fill(grid, {0, 0, -5}, {15, 15, 5}, plane({0, 0, 1}, 0.002));
  const std::size_t whole = extract_mesh(grid, kTruncation, {}).triangles.size();
  EXPECT_EQ(whole, 15U * 15U * 2U);
  grid.find({0, 0, 0})->free[VoxelBlock::index(4, 4, 0)] = kSeen;  // looked through: four cubes less
  EXPECT_EQ(extract_mesh(grid, kTruncation, {}).triangles.size(), whole - 4U * 2U);
}

TEST(MarchingCubes, DropSmallParts) {
  VoxelGrid grid(kVoxel);
  fill(grid, {0, 0, -5}, {15, 15, 5}, plane({0, 0, 1}, 0.002));
  fill(grid, {30, 0, -5}, {35, 5, 5}, plane({0, 0, 1}, 0.002));  // 50 triangles
  SurfaceOptions options;
  options.min_component = 25;
  EXPECT_EQ(extract_mesh(grid, kTruncation, options).triangles.size(), 450U + 50U);
  options.min_component = 26;
  const TriangleMesh mesh = extract_mesh(grid, kTruncation, options);
  EXPECT_EQ(mesh.triangles.size(), 450U);
  EXPECT_EQ(mesh.vertices.size(), 256U);
}

TEST(MeshColors, AreThoseOfTheNearestPointWithinReach) {
  TriangleMesh mesh;
  mesh.vertices = {{0.0F, 0.0F, 0.0F}, {0.1F, 0.0F, 0.0F}, {-0.099F, 0.0F, 0.0F}, {0.0F, 0.5F, 0.0F}};
  SemanticCloud cloud;
  const auto add = [&](float x, Rgb color) {
    CloudPoint point;
    point.position = {x, 0.0F, 0.0F};
    point.color = color;
    cloud.points.push_back(point);
  };
  add(0.006F, {1, 0, 0});
  add(-0.005F, {2, 0, 0});
  add(0.119F, {3, 0, 0});
  add(-0.121F, {4, 0, 0});
  color_mesh(mesh, cloud, kVoxel);
  EXPECT_EQ(mesh.colors[0], (Rgb{2, 0, 0}));
  EXPECT_EQ(mesh.colors[1], (Rgb{3, 0, 0}));
  EXPECT_EQ(mesh.colors[2], (Rgb{128, 128, 128}));
  EXPECT_EQ(mesh.colors[3], (Rgb{128, 128, 128}));
}

}  // namespace
}  // namespace ipl_slam
