#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "map/map.hpp"
#include "mapping/bundle_adjustment.hpp"

namespace ipl_slam {

/// How far a segment may be off.
struct LineNoise {
  double sigma = 1.0;         ///< of its end points across it, at octave 0, px
  double depth_sigma = 0.01;  ///< of its inverse depth, beyond that of its fit, 1/m
};

/// Bundle adjustment of some keyframes of a map: the problem, a copy of what it needs, and what its indices
/// stand for.
class MapBundle {
 public:
  /// Keyframes `free` are optimised, with the landmarks they see that have at least `min_observations`;
  /// `fixed` are others that hold them in place. An anchor does not move either; without fixed keyframes the
  /// oldest free one does not.
  MapBundle(const Map& map, const std::set<KeyframeId>& free, const std::set<KeyframeId>& fixed,
            const LineNoise& line_noise, std::size_t min_observations = 1);

  /// Brings what was adjusted back into the map, which may have changed since: what is gone is left out.
  /// Observations that ended as outliers leave the map, unless the adjustment was aborted. Derived data is
  /// refreshed.
  void write_back(Map& map, const BundleResult& result, const Camera& camera,
                  const DepthNoiseOptions& noise) const;
  /// The keyframes, in the order of problem.poses.
  [[nodiscard]] const std::vector<KeyframeId>& keyframes() const { return poses_; }

  BundleProblem problem;

 private:
  template <class LandmarkId>
  struct Sight {
    LandmarkId landmark;
    Observation observation;
  };

  void add_pose(const Map& map, KeyframeId id, bool fixed);
  void add_points(const Map& map);
  void add_lines(const Map& map, const LineNoise& noise);
  template <class LandmarkId>
  static void remove_outliers(Map& map, const std::vector<Sight<LandmarkId>>& sights,
                              const std::vector<std::uint8_t>& outlier,
                              std::vector<LandmarkId> Keyframe::*seen);

  std::vector<KeyframeId> poses_;
  std::map<KeyframeId, std::uint32_t> pose_index_;
  std::vector<PointId> points_;
  std::vector<LineId> lines_;
  std::vector<Sight<PointId>> point_sights_;  // of the problem's observations
  std::vector<Sight<LineId>> line_sights_;
};

}  // namespace ipl_slam
