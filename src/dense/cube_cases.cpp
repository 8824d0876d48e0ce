#include <algorithm>
#include <cstddef>

#include <opencv2/core.hpp>

#include "dense/marching_cubes.hpp"

namespace ipl_slam {
namespace {

using Polygon = std::vector<std::uint8_t>;  // of edges

int bit(int corner, int axis) {
  return corner >> axis & 1;
}

std::uint8_t edge_between(int a, int b) {
  const int low = std::min(a, b), axis_bit = a ^ b;
  const auto& edges = cube_edges();
  const auto it = std::find_if(edges.begin(), edges.end(),
                               [&](const CubeEdge& e) { return e.corner == low && 1 << e.axis == axis_bit; });
  return static_cast<std::uint8_t>(it - edges.begin());
}

// The corners of a face, anticlockwise as seen from outside the cube.
std::array<int, 4> face_corners(int axis, int side) {
  const int u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3;
  const int base = side << axis;
  if (side == 1) return {base, base | u, base | u | v, base | v};
  return {base, base | v, base | u | v, base | u};
}

bool on_one_face(std::uint8_t a, std::uint8_t b) {
  const CubeEdge &p = cube_edges()[a], &q = cube_edges()[b];
  for (int axis = 0; axis < 3; ++axis) {
    if (p.axis != axis && q.axis != axis && bit(p.corner, axis) == bit(q.corner, axis)) return true;
  }
  return false;
}

// Cuts corners off the polygon until a triangle is left. No cut lies in a face of the cube: the cube on the
// other side might make the same one, and four triangles would meet there. False if there is no such way.
bool triangulate(const Polygon& polygon, std::vector<std::array<std::uint8_t, 3>>& triangles) {
  const std::size_t n = polygon.size();
  if (n == 3) {
    triangles.push_back({polygon[0], polygon[1], polygon[2]});
    return true;
  }
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint8_t before = polygon[(i + n - 1) % n], after = polygon[(i + 1) % n];
    if (on_one_face(before, after)) continue;
    Polygon rest = polygon;
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(i));
    triangles.push_back({before, polygon[i], after});
    if (triangulate(rest, triangles)) return true;
    triangles.pop_back();
  }
  return false;
}

// Walks round each face: where the walk comes in and where it next goes out again the surface cuts the face,
// in a line from the one edge to the other. Each cut edge is the way in on one of its faces and the way out
// on the other, so the lines link up to loops around the part inside.
CubeCase make_case(unsigned inside) {
  CubeCase result;
  const auto is_inside = [&](int corner) { return (inside >> corner & 1U) != 0; };
  std::array<std::uint8_t, 12> next{};
  for (int face = 0; face < 6; ++face) {
    const std::array<int, 4> corners = face_corners(face / 2, face % 2);
    const auto corner = [&](int i) { return corners[static_cast<std::size_t>(i % 4)]; };
    for (int i = 0; i < 4; ++i) {
      if (is_inside(corner(i)) || !is_inside(corner(i + 1))) continue;
      int last = i + 1;
      while (is_inside(corner(last + 1))) ++last;
      const std::uint8_t way_in = edge_between(corner(i), corner(i + 1));
      next[way_in] = edge_between(corner(last), corner(last + 1));
      result.cut = static_cast<std::uint16_t>(result.cut | 1U << way_in);
    }
  }
  unsigned left = result.cut;
  for (std::uint8_t first = 0; first < 12; ++first) {
    Polygon loop;
    for (std::uint8_t e = first; (left >> e & 1U) != 0; e = next[e]) {
      loop.push_back(e);
      left &= ~(1U << e);
    }
    if (!loop.empty()) CV_Assert(triangulate(loop, result.triangles));
  }
  return result;
}

}  // namespace

const std::array<CubeEdge, 12>& cube_edges() {
  static const std::array<CubeEdge, 12> edges = [] {
    std::array<CubeEdge, 12> made{};
    std::size_t count = 0;
    for (int axis = 0; axis < 3; ++axis) {
      for (int corner = 0; corner < 8; ++corner) {
        if (bit(corner, axis) != 0) continue;
        made[count++] = {static_cast<std::uint8_t>(corner), static_cast<std::uint8_t>(axis)};
      }
    }
    return made;
  }();
  return edges;
}

const CubeCase& cube_case(unsigned inside) {
  static const std::vector<CubeCase> cases = [] {
    std::vector<CubeCase> made;
    for (unsigned i = 0; i < 256; ++i) made.push_back(make_case(i));
    return made;
  }();
  return cases[inside];
}

}  // namespace ipl_slam
