#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "common/ids.hpp"
#include "features/frame.hpp"
#include "features/scale_pyramid.hpp"
#include "geometry/se3.hpp"
#include "map/store.hpp"

namespace ipl_slam {

/// A frame kept in the map.
struct Keyframe {
  SE3 T_cw;
  std::shared_ptr<const Frame> frame;
  std::vector<PointId> points;  ///< per keypoint; invalid = none
};

/// One sight of a point landmark.
struct PointObservation {
  KeyframeId keyframe;
  std::uint32_t keypoint = 0;
};

/// A point landmark. Everything below `observations` is derived from them by Map::refresh.
struct Point {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< world, m
  KeyframeId first_keyframe;                           ///< the newest keyframe when it was made
  int visible = 1;                                     ///< frames that should have seen it
  int found = 1;                                       ///< frames that did
  std::vector<PointObservation> observations;          ///< in order of keyframe

  Descriptor descriptor{};  ///< the observed one with the least median distance to the others
  Eigen::Vector3d normal =
      Eigen::Vector3d::Zero();  ///< mean viewing direction, unit, from the cameras to the point
  double min_distance = 0.0, max_distance = 0.0;  ///< from where the pyramid can show it, m
};

/// A keyframe and how many points another one shares with it.
struct Covisible {
  KeyframeId keyframe;
  int shared = 0;
};

/// The map: keyframes and point landmarks under ids. It belongs to one thread (the mapper's); trackers read
/// LocalMap snapshots. Every change goes through the methods below, which keep the two directions of an
/// observation together.
class Map {
 public:
  explicit Map(const ScalePyramid& pyramid) : pyramid_(pyramid) {}

  KeyframeId add_keyframe(std::shared_ptr<const Frame> frame, const SE3& T_cw);
  /// Takes a keyframe out. Its pose stays known relative to `parent`, the keyframe that shares most points
  /// with it, or else the newest. The newest itself must stay: it is what the others hang on in the end.
  void remove_keyframe(KeyframeId id);
  void set_pose(KeyframeId id, const SE3& T_cw) { keyframes_[id].T_cw = T_cw; }

  /// A new point with its first observation, by a keypoint that must not belong to a point yet.
  PointId add_point(const Eigen::Vector3d& position_w, KeyframeId keyframe, std::uint32_t keypoint);
  void remove_point(PointId id);
  void set_position(PointId id, const Eigen::Vector3d& position_w) { points_[id].position = position_w; }
  /// Counts frames in which a point should have been and was seen.
  void count_sightings(PointId id, int visible, int found);

  /// Does nothing where the keyframe already sees the point, or the keypoint already belongs to one.
  void add_observation(PointId id, KeyframeId keyframe, std::uint32_t keypoint);
  /// Removes the point as well when it was the last observation.
  void remove_observation(PointId id, KeyframeId keyframe);
  /// Makes two points one: `gone` disappears, its observations go to `kept`, and resolve(gone) is `kept` from
  /// now on.
  void fuse(PointId kept, PointId gone);
  /// Recomputes descriptor, normal and distance range from the observations.
  void refresh(PointId id);

  /// The point that `id` has become through fusion; invalid when it is gone.
  [[nodiscard]] PointId resolve(PointId id) const;
  /// T_cw of a keyframe that is, or once was, in the map.
  [[nodiscard]] SE3 pose_of(KeyframeId id) const;
  /// Keyframes that share points with `id`, most shared first, then by id. Derived, never stored.
  [[nodiscard]] std::vector<Covisible> covisible(KeyframeId id) const;
  [[nodiscard]] bool observes(KeyframeId keyframe, PointId id) const;

  [[nodiscard]] const Store<KeyframeId, Keyframe>& keyframes() const { return keyframes_; }
  [[nodiscard]] const Store<PointId, Point>& points() const { return points_; }
  [[nodiscard]] const ScalePyramid& pyramid() const { return pyramid_; }
  [[nodiscard]] KeyframeId newest_keyframe() const { return newest_; }

 private:
  struct RemovedKeyframe {
    KeyframeId id, parent;
    SE3 T_c_parent;
  };

  ScalePyramid pyramid_;
  Store<KeyframeId, Keyframe> keyframes_;
  Store<PointId, Point> points_;
  std::vector<RemovedKeyframe> removed_;  // in order of id
  std::vector<PointId> became_;           // per point id: what it was fused into
  KeyframeId newest_;
};

}  // namespace ipl_slam
