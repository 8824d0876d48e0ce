#pragma once

#include <vector>

#include "common/options.hpp"
#include "map/map.hpp"

namespace ipl_slam {

struct EssentialGraphOptions {
  int strong_shared = 100;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("strong_shared", strong_shared,
             {1, 10000, "count", "two keyframes that share this many landmarks are tied to each other"});
  }
};

/// Two keyframes and where they stand relative to each other in the map as it is.
struct EssentialEdge {
  KeyframeId a, b;  ///< a < b
  int shared = 0;   ///< landmarks that both see
  SE3 T_ab;         ///< camera b to camera a
};

/// The essential graph of a part of the map, after Mur-Artal et al., "ORB-SLAM", T-RO 2015, III-D: few edges,
/// but those that hold the part together. In order of a, then b:
///
/// * a spanning tree of the keyframes that share most (derived; ties go to the older keyframes). Where shared
///   landmarks leave the part in pieces, successive keyframes tie these together: the graph is connected;
/// * keyframes that share many landmarks, and successive ones that share any;
/// * the loops closed before. Their relative pose is the map's as well: bundle adjustment knows it better by
///   now than the match did that found it.
[[nodiscard]] std::vector<EssentialEdge> essential_graph(const Map& map, PartId part,
                                                         const EssentialGraphOptions& options);

}  // namespace ipl_slam
