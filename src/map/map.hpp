#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "common/ids.hpp"
#include "dynamics/feature_weights.hpp"
#include "features/frame.hpp"
#include "features/line_features.hpp"
#include "features/scale_pyramid.hpp"
#include "geometry/line3.hpp"
#include "geometry/se3.hpp"
#include "map/store.hpp"

namespace ipl_slam {

/// A frame kept in the map.
struct Keyframe {
  SE3 T_cw;
  std::shared_ptr<const Frame> frame;
  std::shared_ptr<const LineFeatures> line_features;  ///< never null, empty where no lines were looked for
  std::vector<PointId> points;                        ///< per keypoint; invalid = none
  std::vector<LineId> lines;                          ///< per segment; invalid = none
  FeatureTrust point_trust, line_trust;               ///< of keypoints and segments
  PartId part;                                        ///< the part of the map it belongs to
};

/// One sight of a landmark.
struct Observation {
  KeyframeId keyframe;
  std::uint32_t feature = 0;  ///< of the keyframe: a keypoint for a point, a segment for a line
};

/// A point landmark. Everything below `observations` is derived from them by Map::refresh.
struct Point {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< world, m
  KeyframeId first_keyframe;                           ///< the newest keyframe when it was made
  int visible = 1;                                     ///< frames that should have seen it
  int found = 1;                                       ///< frames that did
  std::vector<Observation> observations;               ///< in order of keyframe

  Descriptor descriptor{};  ///< the observed one with the least median distance to the others
  Eigen::Vector3d normal =
      Eigen::Vector3d::Zero();  ///< mean viewing direction, unit, from the cameras to the point
  double min_distance = 0.0, max_distance = 0.0;  ///< from where the pyramid can show it, m
};

/// A line landmark: an infinite line, and how much of it has been seen. Everything below `observations` is
/// derived from them by Map::refresh.
struct Line {
  Line3 line;  ///< world
  /// Ends of what has been seen, on the line; start -> end is its direction, with the brighter side on the
  /// right (features/line_features.hpp). World, m.
  Eigen::Vector3d start = Eigen::Vector3d::Zero(), end = Eigen::Vector3d::Zero();
  KeyframeId first_keyframe;              ///< the newest keyframe when it was made
  int visible = 1;                        ///< frames that should have seen it
  int found = 1;                          ///< frames that did
  std::vector<Observation> observations;  ///< in order of keyframe

  Descriptor descriptor{};  ///< the observed one with the least median distance to the others
  float contrast = 0.0F;    ///< mean step of the grey value across it
};

/// A keyframe and how many landmarks another one shares with it.
struct Covisible {
  KeyframeId keyframe;
  int shared = 0;
};

/// A place that was recognised: two keyframes whose relative pose is known though they may share no landmark.
struct LoopEdge {
  KeyframeId a, b;
  SE3 T_ab;  ///< camera b to camera a
};

/// The map: keyframes, point and line landmarks under ids. It belongs to one thread (the mapper's); trackers
/// read LocalMap snapshots. Every change goes through the methods below, which keep the two directions of an
/// observation together. Where a method takes a LandmarkId it takes a PointId or a LineId.
///
/// A map has one part as long as tracking never breaks off. What is mapped after that, before a known place
/// is recognised, is a part of its own: its world frame has no known place in that of the others, and no
/// landmark is seen from two parts. A part's world frame hangs on its anchor, its oldest keyframe.
class Map {
 public:
  explicit Map(const ScalePyramid& pyramid) : pyramid_(pyramid) {}

  /// `line_features` may be null: no lines were looked for. T_cw in the world of `part`, one there is or
  /// new_part().
  KeyframeId add_keyframe(std::shared_ptr<const Frame> frame, const SE3& T_cw,
                          std::shared_ptr<const LineFeatures> line_features = nullptr,
                          FeatureTrust point_trust = {}, FeatureTrust line_trust = {},
                          PartId part = PartId{0});
  /// Takes a keyframe out. Its pose stays known relative to `parent`, the keyframe that shares most landmarks
  /// with it, or else the anchor of its part; its loop edges become the parent's. Neither an anchor nor the
  /// newest keyframe can be taken out.
  void remove_keyframe(KeyframeId id);
  void set_pose(KeyframeId id, const SE3& T_cw) { keyframes_[id].T_cw = T_cw; }

  /// A new point with its first observation, by a keypoint that must not belong to a point yet nor be
  /// removed.
  PointId add_point(const Eigen::Vector3d& position_w, KeyframeId keyframe, std::uint32_t keypoint);
  void set_position(PointId id, const Eigen::Vector3d& position_w) { points_[id].position = position_w; }
  /// A new line from start_w to end_w with its first observation, by a segment that must not belong to a line
  /// yet nor be removed.
  LineId add_line(const Line3& line_w, const Eigen::Vector3d& start_w, const Eigen::Vector3d& end_w,
                  KeyframeId keyframe, std::uint32_t segment);
  void set_line(LineId id, const Line3& line_w, const Eigen::Vector3d& start_w, const Eigen::Vector3d& end_w);

  /// Puts a landmark in as it was saved, after the keyframes that see it: `first_keyframe`, the counts and
  /// the observations stay as they are, what is derived from these is computed. The observations are there,
  /// in order of keyframe, by features that belong to no landmark and are not removed.
  PointId restore(Point point);
  LineId restore(Line line);

  /// The part that the next keyframe starts when it belongs to none there is.
  [[nodiscard]] PartId new_part() const { return PartId{static_cast<std::uint32_t>(anchors_.size())}; }
  /// Makes two parts one: poses and landmarks of `gone`, the younger one, move into the world of `kept`.
  void merge_parts(PartId kept, PartId gone, const SE3& T_kept_gone);
  void add_loop(const LoopEdge& edge) { loops_.push_back(edge); }

  template <class LandmarkId>
  void remove(LandmarkId id);
  /// Counts frames in which a landmark should have been and was seen.
  template <class LandmarkId>
  void count_sightings(LandmarkId id, int visible, int found);
  /// Does nothing where the keyframe already sees the landmark, the feature already belongs to one, or was
  /// removed (weight 0).
  template <class LandmarkId>
  void add_observation(LandmarkId id, KeyframeId keyframe, std::uint32_t feature);
  /// Removes the landmark as well when it was the last observation.
  template <class LandmarkId>
  void remove_observation(LandmarkId id, KeyframeId keyframe);
  /// Makes two landmarks one: `gone` disappears, its observations go to `kept`, and resolve(gone) is `kept`
  /// from now on.
  template <class LandmarkId>
  void fuse(LandmarkId kept, LandmarkId gone);
  /// Recomputes what is derived from the observations.
  void refresh(PointId id);
  void refresh(LineId id);

  /// The landmark that `id` has become through fusion; invalid when it is gone.
  template <class LandmarkId>
  [[nodiscard]] LandmarkId resolve(LandmarkId id) const;
  /// T_cw of a keyframe that is, or once was, in the map.
  [[nodiscard]] SE3 pose_of(KeyframeId id) const;
  /// The keyframe itself where it is in the map; where it was taken out, the one its pose hangs on.
  [[nodiscard]] KeyframeId surviving(KeyframeId id) const;
  /// The part of a keyframe that is, or once was, in the map.
  [[nodiscard]] PartId part_of(KeyframeId id) const { return keyframes_[surviving(id)].part; }
  [[nodiscard]] KeyframeId anchor(PartId part) const { return anchors_[part.value]; }
  [[nodiscard]] bool is_anchor(KeyframeId id) const { return anchor(keyframes_[id].part) == id; }
  /// Those there are, the oldest first.
  [[nodiscard]] std::vector<PartId> parts() const;
  [[nodiscard]] const std::vector<LoopEdge>& loops() const { return loops_; }
  /// Keyframes that share landmarks with `id`, most shared first, then by id. Derived, never stored.
  [[nodiscard]] std::vector<Covisible> covisible(KeyframeId id) const;
  template <class LandmarkId>
  [[nodiscard]] bool observes(KeyframeId keyframe, LandmarkId id) const;

  [[nodiscard]] const Store<KeyframeId, Keyframe>& keyframes() const { return keyframes_; }
  [[nodiscard]] const Store<PointId, Point>& points() const { return points_; }
  [[nodiscard]] const Store<LineId, Line>& lines() const { return lines_; }
  [[nodiscard]] const ScalePyramid& pyramid() const { return pyramid_; }
  [[nodiscard]] KeyframeId newest_keyframe() const { return newest_; }

 private:
  struct RemovedKeyframe {
    KeyframeId id, parent;
    SE3 T_c_parent;
  };

  // What tells points and lines apart: where they are stored, and where a keyframe keeps them.
  Store<PointId, Point>& store(PointId) { return points_; }
  Store<LineId, Line>& store(LineId) { return lines_; }
  [[nodiscard]] const Store<PointId, Point>& store(PointId) const { return points_; }
  [[nodiscard]] const Store<LineId, Line>& store(LineId) const { return lines_; }
  std::vector<PointId>& became(PointId) { return became_point_; }
  std::vector<LineId>& became(LineId) { return became_line_; }
  [[nodiscard]] const std::vector<PointId>& became(PointId) const { return became_point_; }
  [[nodiscard]] const std::vector<LineId>& became(LineId) const { return became_line_; }
  PointId& slot(KeyframeId keyframe, std::uint32_t keypoint, PointId) {
    return keyframes_[keyframe].points[keypoint];
  }
  LineId& slot(KeyframeId keyframe, std::uint32_t segment, LineId) {
    return keyframes_[keyframe].lines[segment];
  }
  [[nodiscard]] const FeatureTrust& trust(KeyframeId keyframe, PointId) const {
    return keyframes_[keyframe].point_trust;
  }
  [[nodiscard]] const FeatureTrust& trust(KeyframeId keyframe, LineId) const {
    return keyframes_[keyframe].line_trust;
  }
  template <class LandmarkId, class Landmark>
  LandmarkId restore_as(Landmark landmark);
  template <class LandmarkId, class Landmark>
  LandmarkId insert(Landmark landmark, KeyframeId keyframe, std::uint32_t feature);
  /// Null for a keyframe that was not removed.
  [[nodiscard]] const RemovedKeyframe* find_removed(KeyframeId id) const;

  ScalePyramid pyramid_;
  Store<KeyframeId, Keyframe> keyframes_;
  Store<PointId, Point> points_;
  Store<LineId, Line> lines_;
  std::vector<RemovedKeyframe> removed_;  // in order of id
  std::vector<PointId> became_point_;     // per point id: what it was fused into
  std::vector<LineId> became_line_;       // the same of lines
  KeyframeId newest_;
  std::vector<KeyframeId> anchors_;  // per part; invalid once it was merged into another
  std::vector<LoopEdge> loops_;
};

}  // namespace ipl_slam
