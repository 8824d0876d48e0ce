#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "features/edge_map.hpp"

namespace ipl_slam {

/// A place on an edge.
struct EdgePoint {
  float u = 0.0F, v = 0.0F;    ///< pixels of the image it was found in, to a fraction of a pixel
  float du = 0.0F, dv = 0.0F;  ///< direction of the edge, the brighter side on its right; not normalised
};

/// Curves along the edges of an image, each a run of neighbouring pixels with the brighter side on its right.
struct EdgeChains {
  std::vector<EdgePoint> points;    ///< of all chains, one after the other
  std::vector<std::size_t> begins;  ///< where each chain begins, and at last where the last one ends
};

/// Walks along the ridges of the gradient (Topal and Akinlar, "Edge drawing: a combined real-time edge and
/// segment detector", JVCIR 2012): from every ridge pixel, the strongest first, one pixel after the other to
/// the strongest of the three neighbours ahead, in both directions. Here "ahead" comes from the gradient at
/// the pixel alone, so that a walk never turns round and never changes over to an edge of opposite contrast.
/// Positions are those of the peak of a parabola through the magnitudes across the edge.
class EdgeChainFinder {
 public:
  /// A chain ends where the magnitude falls below `min_magnitude` (units of EdgeMap); chains of fewer than
  /// `min_points` points are dropped. `chains` keeps its memory from call to call.
  void find(const EdgeMap& map, int min_magnitude, std::size_t min_points, EdgeChains& chains);

 private:
  void collect_anchors(const EdgeMap& map);
  void follow(const EdgeMap& map, std::size_t from, int direction, int min_magnitude);

  std::vector<std::uint32_t> anchors_, unsorted_, path_;
  std::vector<std::size_t> bucket_ends_;
  std::vector<std::uint8_t> visited_;
};

}  // namespace ipl_slam
