#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "dense/semantic_cloud.hpp"
#include "dense/surface_options.hpp"
#include "dense/triangle_mesh.hpp"
#include "dense/voxel_grid.hpp"

namespace ipl_slam {

/// How the surface cuts a cube of eight voxels. Corner c lies at (c & 1, c >> 1 & 1, c >> 2 & 1); edges are
/// numbered by cube_edges().
struct CubeCase {
  std::uint16_t cut = 0;                               ///< bit e: edge e is cut
  std::vector<std::array<std::uint8_t, 3>> triangles;  ///< edges, anticlockwise from the free side
};

/// An edge of the cube, from a corner in the direction of an axis.
struct CubeEdge {
  std::uint8_t corner, axis;
};

[[nodiscard]] const std::array<CubeEdge, 12>& cube_edges();
/// inside: bit c is set where corner c lies behind the surface. Of a face with two opposite corners inside
/// these two are parted; that depends on the face alone, so cubes side by side agree and no hole appears.
[[nodiscard]] const CubeCase& cube_case(unsigned inside);

/// The surfaces in a volume, as triangles (Lorensen and Cline, "Marching cubes: a high resolution 3D surface
/// construction algorithm", SIGGRAPH 1987), where all eight voxels of a cube are known. One vertex per cut
/// edge, shared by the triangles around it. Small parts are dropped. Without colours. truncation: that of the
/// volume, m.
[[nodiscard]] TriangleMesh extract_mesh(const VoxelGrid& grid, double truncation,
                                        const SurfaceOptions& options);

/// Gives each vertex the colour of the nearest point of the cloud within two voxels, grey where there is
/// none. voxel: size of a voxel, m.
void color_mesh(TriangleMesh& mesh, const SemanticCloud& cloud, double voxel);

}  // namespace ipl_slam
