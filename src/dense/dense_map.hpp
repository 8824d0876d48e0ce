#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <set>
#include <vector>

#include "common/ids.hpp"
#include "common/options.hpp"
#include "dense/cloud_painter.hpp"
#include "dense/keyframe_folder.hpp"
#include "dense/left_out.hpp"
#include "dense/occupancy_grid.hpp"
#include "dense/occupancy_map.hpp"
#include "dense/range_image.hpp"
#include "dense/semantic_cloud.hpp"
#include "dense/surface_extractor.hpp"
#include "dense/triangle_mesh.hpp"
#include "dense/tsdf_volume.hpp"
#include "dense/upright.hpp"
#include "dense/view_maker.hpp"
#include "dense/view_store.hpp"
#include "geometry/camera.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {

struct DenseOptions {
  bool enabled = true;
  double tolerance = 0.002;  ///< m
  int changes = 4;
  RangeOptions range;
  LeftOutOptions left_out;
  VolumeOptions volume;
  SurfaceOptions surface;
  PaintOptions paint;
  UprightOptions upright;
  OccupancyOptions occupancy;
  OccupancyMapOptions floor_plan;

  template <class Visitor>
  void visit(Visitor& v) {
    v.flag("enabled", enabled, "keep the keyframes' images and make a cloud of them");
    v.number("tolerance", tolerance,
             {0.0, 1.0, "m",
              "realtime: a keyframe whose surfaces moved by more than this is integrated again; in lockstep "
              "every one whose pose changed is"});
    v.number("changes", changes,
             {1, 1000, "keyframes",
              "realtime: keyframes integrated, for the first time or again, at most when a new one comes"});
    v.section("range", range, "which measured depth is taken for a surface");
    v.section("left_out", left_out, "who is left out of the cloud");
    v.section("volume", volume, "fusion of depth");
    v.section("surface", surface, "what counts as a surface");
    v.section("paint", paint, "colours, classes and objects");
    v.section("upright", upright, "which way is up, for floor plan and OctoMap");
    v.section("occupancy", occupancy, "cells of floor plan and OctoMap");
    v.section("floor_plan", floor_plan, "heights over the floor that make an obstacle");
  }
};

/// Where a view was taken, and who moved in it.
struct ViewSituation {
  SE3 T_cw;
  std::set<InstanceId> moved;

  friend bool operator==(const ViewSituation& a, const ViewSituation& b) {
    return a.T_cw.rotation().coeffs() == b.T_cw.rotation().coeffs() &&
           a.T_cw.translation() == b.T_cw.translation() && a.moved == b.moved;
  }
};

/// The static world as keyframes saw it: dense, coloured and labelled, without what moved (paper, section
/// 4.4). Views are kept, so that the volume can follow when poses change: the cloud depends on the views,
/// their poses and who moved in them alone, not on how these came to be known. To be used by one thread at a
/// time.
class DenseMap {
 public:
  /// Throws UserError where the views' temporary file cannot be made.
  DenseMap(const Camera& camera, const DenseOptions& options);

  /// Keeps the view of a keyframe; images as they come from the camera. It enters the volume with follow().
  void add(KeyframeId id, double timestamp, const cv::Mat& color, const cv::Mat& depth,
           const std::vector<TrackedInstance>& instances);
  /// Keeps the views of a folder, as read_keyframe_folder(). Throws UserError, besides, where they were taken
  /// by another camera.
  [[nodiscard]] KeptKeyframes add(const std::filesystem::path& folder);

  /// Brings the volume to `wanted`: views that are not in it are taken in, those whose surfaces moved by more
  /// than `tolerance` (m, 2 m before the camera) or in which other people moved are taken in anew, those that
  /// are not wanted are taken out. `changes`: how many at most, those that are missing first. Calls
  /// `progress` after each. Returns how many changes there were.
  std::size_t follow(const std::map<KeyframeId, ViewSituation>& wanted, double tolerance = 0.0,
                     std::size_t changes = std::numeric_limits<std::size_t>::max(),
                     const std::function<void()>& progress = {});

  struct Result {
    SemanticCloud cloud;
    std::vector<CloudObject> objects;
  };
  /// The cloud of what is in the volume. Calls `progress` twice a view.
  [[nodiscard]] Result cloud(const std::function<void()>& progress = {});
  /// Its surface as triangles, in the cloud's colours.
  [[nodiscard]] TriangleMesh mesh(const SemanticCloud& cloud) const;

  [[nodiscard]] const ViewStore& views() const { return views_; }
  [[nodiscard]] const Camera& camera() const { return camera_; }
  [[nodiscard]] const DenseOptions& options() const { return options_; }
  /// How a view stands in the volume; null where it does not.
  [[nodiscard]] const ViewSituation* in_volume(KeyframeId id) const;
  /// Views in the volume.
  [[nodiscard]] std::size_t size() const { return in_volume_.size(); }
  /// What the volume takes in of a view.
  [[nodiscard]] RangeImage range_image(KeyframeId id, const std::set<InstanceId>& moved) const;
  [[nodiscard]] const TsdfVolume& volume() const { return volume_; }
  /// How often it was begun anew because most of it had to go.
  [[nodiscard]] std::size_t rebuilds() const { return rebuilds_; }

 private:
  struct InVolume {
    ViewSituation situation;
    TsdfVolume::Moment since = 0;
  };

  void take_in(KeyframeId id, const ViewSituation& situation);
  void take_out(KeyframeId id);

  Camera camera_;  // undistorted
  DenseOptions options_;
  ViewMaker maker_;
  ViewStore views_;
  TsdfVolume volume_;
  std::map<KeyframeId, InVolume> in_volume_;
  std::size_t rebuilds_ = 0;
};

}  // namespace ipl_slam
