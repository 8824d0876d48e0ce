#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "common/options.hpp"
#include "map/map.hpp"

namespace ipl_slam {

struct LocalMapOptions {
  int max_keyframes = 60;
  int neighbours = 10;
  double nearby_distance = 1.0;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("max_keyframes", max_keyframes,
             {2, 1000, "count", "keyframes whose landmarks the tracker searches for"});
    v.number("neighbours", neighbours,
             {0, 100, "count", "best covisible keyframes whose own neighbours are added"});
    v.number("nearby_distance", nearby_distance,
             {0.0, 100.0, "m",
              "keyframes this near that look the same way are added even if they share no landmark"});
  }
};

/// What the tracker needs to know of a point landmark.
struct LocalPoint {
  PointId id;
  Eigen::Vector3d position;           ///< world, m
  Eigen::Vector3d normal;             ///< mean viewing direction, unit
  double min_distance, max_distance;  ///< m
  Descriptor descriptor;
  int observations;  ///< keyframes that see it
};

/// What the tracker needs to know of a line landmark.
struct LocalLine {
  LineId id;
  Line3 line;                  ///< world
  Eigen::Vector3d start, end;  ///< of what has been seen of it, world, m
  float contrast;              ///< mean step of the grey value across it
  int observations;            ///< keyframes that see it
  double weight = 1.0;         ///< alpha_l where the newest of them sees it
};

/// What the tracker needs to know of a keyframe.
struct LocalKeyframe {
  KeyframeId id;
  SE3 T_cw;
  std::shared_ptr<const Frame> frame;
  std::vector<std::uint32_t> points;  ///< indices into LocalMap::points of the points it sees
  std::vector<std::uint32_t> lines;   ///< indices into LocalMap::lines of the lines it sees
};

/// Immutable copy of what the map holds around one keyframe. The mapper publishes one after each keyframe;
/// the tracker reads it while the mapper goes on changing the map.
struct LocalMap {
  KeyframeId centre;                     ///< the keyframe it was built around
  PartId part;                           ///< the part of the map it belongs to
  int corrections = 0;                   ///< how often the whole map was corrected before it was built
  std::optional<SE3> found;              ///< T_cw of a lost frame, where it was built to take that up again
  std::vector<LocalKeyframe> keyframes;  ///< in order of id
  std::vector<LocalPoint> points;        ///< in order of id
  std::vector<LocalLine> lines;          ///< in order of id

  /// Null when the keyframe is not part of the local map.
  [[nodiscard]] const LocalKeyframe* find_keyframe(KeyframeId id) const;
  /// Index into points, or -1.
  [[nodiscard]] int find_point(PointId id) const;
};

/// The keyframes that share landmarks with `centre`, the best of these keyframes' own neighbours, the
/// keyframes nearby, and all landmarks they see.
[[nodiscard]] LocalMap build_local_map(const Map& map, KeyframeId centre, const LocalMapOptions& options);

}  // namespace ipl_slam
