#pragma once

#include <vector>

#include "common/options.hpp"
#include "map/map.hpp"

namespace ipl_slam {

struct CullingOptions {
  double min_found_ratio = 0.25;
  int probation = 2;
  int min_observations = 2;
  double redundant_share = 0.9;
  int redundant_observers = 3;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("min_found_ratio", min_found_ratio,
             {0.0, 1.0, "ratio",
              "a new landmark goes when it is found in fewer of the frames that should see it"});
    v.number("probation", probation, {1, 100, "keyframes", "how long a landmark counts as new"});
    v.number("min_observations", min_observations,
             {1, 100, "count", "keyframes that must see a landmark when its probation ends"});
    v.number("redundant_share", redundant_share,
             {0.5, 1.01, "ratio",
              "a keyframe goes when this share of its landmarks is seen well by others; above 1 = never"});
    v.number("redundant_observers", redundant_observers, {1, 100, "count", "how many others that takes"});
  }
};

/// Landmarks of one kind (PointId or LineId) made lately, which still have to prove themselves.
template <class LandmarkId>
class LandmarkCulling {
 public:
  explicit LandmarkCulling(const CullingOptions& options) : options_(options) {}

  void watch(LandmarkId id) { recent_.push_back(id); }
  /// Removes the landmarks that failed; stops watching those that passed.
  void cull(Map& map);

 private:
  CullingOptions options_;
  std::vector<LandmarkId> recent_;
};

/// Removes keyframes around `centre` that show nothing the others do not show as well at the same or a finer
/// scale, or one pyramid level coarser. Never an anchor, which holds its part's world frame, nor the
/// newest.
void cull_keyframes(Map& map, KeyframeId centre, const CullingOptions& options);

}  // namespace ipl_slam
