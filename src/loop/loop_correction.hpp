#pragma once

#include <atomic>
#include <cstddef>
#include <set>

#include "common/options.hpp"
#include "loop/essential_graph.hpp"
#include "loop/place_verifier.hpp"
#include "loop/pose_graph.hpp"
#include "map/map.hpp"
#include "mapping/local_mapper.hpp"

namespace ipl_slam {

struct LoopCorrectionOptions {
  int side_keyframes = 20;
  int min_shared = 15;
  EssentialGraphOptions graph;
  PoseGraphOptions solver;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("side_keyframes", side_keyframes,
             {1, 1000, "count", "keyframes on either side of a recognised place that are joined, at most"});
    v.number("min_shared", min_shared,
             {1, 1000, "count", "landmarks they share, at least, with the keyframe that was recognised"});
    v.section("graph", graph, "essential graph, over which an error is spread");
    v.section("solver", solver, "pose graph optimisation");
  }
};

/// What a recognised place did to the map.
struct CorrectionEffect {
  bool done = false;                  ///< false: it was aborted before anything had changed
  double translation = 0.0;           ///< error that was found, m
  double rotation = 0.0;              ///< rad
  std::size_t here = 0, there = 0;    ///< keyframes joined around the current and around the recognised one
  std::size_t points = 0, lines = 0;  ///< landmarks that turned out to be another one
};

/// Brings the map in line with a place that was recognised.
class LoopCorrection {
 public:
  LoopCorrection(const Camera& camera, const ScalePyramid& pyramid, const DepthNoiseOptions& noise,
                 const MappingOptions& mapping, const LoopCorrectionOptions& options);

  /// Corrects the drift that a recognised place reveals: `current`, a keyframe, was found by `match` in its
  /// own part of the map. The keyframes around it and their landmarks move rigidly to where the match says;
  /// the rest of the error is spread over the essential graph, every landmark following a keyframe that sees
  /// it; what both sides saw under two ids is joined; the loop edge is remembered. The anchor of the part
  /// stays: where it lies around `current`, the other side of the loop moves instead. Global bundle
  /// adjustment is left to the caller. `abort` is heard before the map changes, and then nothing has.
  CorrectionEffect close_loop(Map& map, KeyframeId current, const PlaceMatch& match,
                              const std::atomic<bool>* abort = nullptr) const;

  /// `current` was found by `match` in another part: the younger part moves into the older one's world, what
  /// both saw is joined, the keyframes along the seam and their landmarks are adjusted (welding window,
  /// Campos et al., "ORB-SLAM3", T-RO 2021, V-C), held by the older part alone, and the rest of the younger
  /// part follows over its essential graph. The older part's anchor stays. `abort` ends the adjustment early:
  /// the parts are one all the same.
  CorrectionEffect merge_parts(Map& map, KeyframeId current, const PlaceMatch& match,
                               const std::atomic<bool>* abort = nullptr) const;

 private:
  /// Keyframes on both sides of a recognised place; none is on both.
  struct Sides {
    std::set<KeyframeId> here, there;
  };

  [[nodiscard]] Sides sides_of(const Map& map, KeyframeId current, KeyframeId found) const;
  void join(Map& map, KeyframeId current, const PlaceMatch& match, const Sides& sides,
            CorrectionEffect& effect) const;
  void join_matched(Map& map, KeyframeId current, const PlaceMatch& match) const;
  void weld(Map& map, const Sides& sides, const std::set<KeyframeId>& kept,
            const std::vector<EssentialEdge>& gone_graph, const std::atomic<bool>* abort) const;

  Camera camera_;
  DepthNoiseOptions noise_;
  LandmarkFusion fusion_;
  LineMapping line_mapping_;
  LocalBundleOptions bundle_;
  LoopCorrectionOptions options_;
};

}  // namespace ipl_slam
