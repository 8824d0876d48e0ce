#pragma once

#include <map>
#include <set>
#include <vector>

#include "common/ids.hpp"
#include "dense/dense_map.hpp"
#include "dense/keyframe_folder.hpp"
#include "dynamics/dynamic_spans.hpp"
#include "map/map.hpp"

namespace ipl_slam {

/// What is known, beside its images, of a keyframe that the dense map keeps a view of.
struct KeptView {
  std::size_t frame_index = 0;
  std::set<InstanceId> classed = {}, unclassed = {};  ///< instances in it, with and without a class
  std::set<InstanceId> dynamic = {};  ///< of these, those whose features were removed when it was tracked
};

/// Where a keyframe that was once in the map is now: as seen from a keyframe that is in it.
struct ViewAnchor {
  KeyframeId reference;  ///< itself while it is in the map
  SE3 T_c_reference;
};

[[nodiscard]] ViewAnchor anchor_of(const Map& map, KeyframeId id);
/// T_cw of the view, in the world of its part.
[[nodiscard]] SE3 pose_of(const Map& map, const ViewAnchor& anchor);

/// Where the views of a folder are, given the map that its keyframes were made with: those whose keyframe is
/// in this part.
[[nodiscard]] std::map<KeyframeId, ViewSituation> situations_of(const KeptKeyframes& kept, const Map& map,
                                                                PartId part);

/// The views the dense map keeps, and what becomes of them as the map changes and more is found out about who
/// moved.
class DenseViews {
 public:
  void add(KeyframeId id, KeptView view);
  [[nodiscard]] const std::map<KeyframeId, KeptView>& all() const { return views_; }

  /// Who is to be left out of a view because it moved. Something without a class is only in the picture
  /// because it may move, so it is left out everywhere once it did; a thing with a class where it moves: it
  /// may stand still elsewhere. `spans`: where instances moved, known at the end; may be null.
  [[nodiscard]] std::set<InstanceId> moved_in(KeyframeId id, const DynamicSpans* spans) const;
  /// The views of keyframes of one part.
  [[nodiscard]] std::map<KeyframeId, ViewSituation> in_part(const Map& map, PartId part,
                                                            const DynamicSpans* spans) const;
  /// All whose keyframes came to the map, to be written with their images.
  [[nodiscard]] KeptKeyframes kept(const Map& map, const DynamicSpans* spans) const;
  /// The part that most views are of.
  [[nodiscard]] PartId main_part(const Map& map) const;

 private:
  std::map<KeyframeId, KeptView> views_;
  std::set<InstanceId> ever_dynamic_;
};

}  // namespace ipl_slam
