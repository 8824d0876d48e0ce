#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "dense/semantic_cloud.hpp"

namespace ipl_slam {

/// A surface of triangles, in the world frame of the map.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;                ///< m
  std::vector<Rgb> colors;                              ///< per vertex
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< vertices, anticlockwise as seen from outside
};

}  // namespace ipl_slam
