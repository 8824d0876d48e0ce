#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "common/options.hpp"
#include "features/edge_chains.hpp"

namespace ipl_slam {

/// Settings of the straight pieces of a chain.
struct ChainSplitterOptions {
  double max_deviation = 0.7;         ///< pixels
  double max_direction_error = 22.5;  ///< degrees
  int seed_points = 12;
  int max_misses = 4;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("max_deviation", max_deviation,
             {0.1, 5.0, "px", "of a point from the line fitted so far; pixels of the octave"});
    v.number("max_direction_error", max_direction_error,
             {1.0, 90.0, "deg", "between the line and the edge's direction at a point"});
    v.number("seed_points", seed_points, {4, 100, "count", "neighbouring points a line begins with"});
    v.number("max_misses", max_misses, {0, 100, "count", "points in a row off the line after which it ends"});
  }
};

/// A straight piece of a chain, from its first to its last point.
struct StraightPiece {
  Eigen::Vector2d start, end;
};

/// Cuts a chain into straight pieces by fitting lines incrementally (Akinlar and Topal, "EDLines: a real-time
/// line segment detector with a false detection control", Pattern Recognition Letters 2011; least squares
/// across the line as in Suarez et al., "ELSED: enhanced line segment drawing", Pattern Recognition 2022): a
/// line begins with a run of points that agree with it in place and direction and takes up the following ones
/// while they agree. Curves give short pieces or none. `pixel` is the size of the octave's pixel in the units
/// of the points. Appends to `pieces`.
void split_chain(std::span<const EdgePoint> chain, double pixel, const ChainSplitterOptions& options,
                 std::vector<StraightPiece>& pieces);

}  // namespace ipl_slam
