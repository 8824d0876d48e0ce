#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <opencv2/core.hpp>

#include "common/options.hpp"
#include "geometry/camera.hpp"
#include "map/local_map.hpp"
#include "tracking/line_tracker.hpp"
#include "tracking/line_visibility.hpp"
#include "tracking/motion_model.hpp"
#include "tracking/pose_optimizer.hpp"
#include "tracking/relocalizer.hpp"
#include "tracking/sighting_counter.hpp"
#include "tracking/tracked_frame.hpp"
#include "tracking/visibility.hpp"

namespace ipl_slam {

struct TrackerOptions {
  int min_initial_depths = 100;
  double prediction_radius = 10.0;
  int min_prediction_inliers = 20;
  int confident_inliers = 100;
  double local_radius = 3.0;
  int min_inliers = 30;
  int min_inliers_recovering = 50;
  double line_support = 3.0;
  double max_deviation = 0.05;
  double max_dynamic_share = 0.2;
  int relocalization_keyframes = 8;
  double new_part_after = 2.0;
  MatchOptions last_frame_match;
  MatchOptions local_map_match;
  LineTrackerOptions lines;
  PoseOptimizerOptions pose;
  RelocalizerOptions relocalizer;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("min_initial_depths", min_initial_depths,
             {10, 10000, "count",
              "keypoints with depth that a frame needs to start the map; lines count too, see line_support"});
    v.number("prediction_radius", prediction_radius,
             {1.0, 100.0, "px",
              "search window around a point of the last frame, or a landmark after relocalisation, at "
              "pyramid level 0"});
    v.number("min_prediction_inliers", min_prediction_inliers,
             {6, 1000, "count", "inliers with which the predicted pose is believed"});
    v.number("confident_inliers", confident_inliers,
             {6, 10000, "count",
              "with fewer, wider windows and a search without prediction are tried as well, "
              "and the depth of lines is measured"});
    v.number("local_radius", local_radius,
             {1.0, 50.0, "px", "search window around a landmark of the local map, at pyramid level 0"});
    v.number("min_inliers", min_inliers,
             {6, 1000, "count", "landmarks a frame must see to count as tracked"});
    v.number("min_inliers_recovering", min_inliers_recovering,
             {6, 1000, "count", "the same while the camera is lost"});
    v.number("line_support", line_support,
             {0.0, 100.0, "points",
              "points that a line counts for where points are counted: inliers, keypoints with depth"});
    v.number(
        "max_deviation", max_deviation,
        {0.001, 10.0, "m",
         "lines count only where the pose is known to this in its least certain direction (of a turn, rad): "
         "parallel ones leave one open"});
    v.number("max_dynamic_share", max_dynamic_share,
             {0.0, 1.0, "share", "of a line that may lie in dynamic regions; a line with more is not used"});
    v.number("relocalization_keyframes", relocalization_keyframes,
             {1, 1000, "count",
              "keyframes of the local map a frame that lost its place is compared with; the next frame goes "
              "on with the others"});
    v.number("new_part_after", new_part_after,
             {0.0, 3600.0, "s", "a camera lost for this long starts a new part of the map; 0 = never"});
    v.section("last_frame_match", last_frame_match, "descriptor match with a point of the last frame");
    v.section("local_map_match", local_map_match, "descriptor match with a landmark of the local map");
    v.section("lines", lines, "lines of the local map in ordinary frames");
    v.section("pose", pose, "pose-only optimisation");
    v.section("relocalizer", relocalizer, "pose from a keyframe, when prediction fails");
  }
};

/// Finds the camera's pose in each frame: predict, match the last frame's points, then the local map's
/// points and lines, optimise.
class Tracker {
 public:
  /// Every random choice depends on `seed` as well.
  Tracker(const Camera& camera, const ScalePyramid& pyramid, const DepthNoiseOptions& noise,
          const TrackerOptions& options, const SegmentDepthOptions& line_depth = {}, std::uint64_t seed = 0);

  /// A first pose (T_cw) for the frame that track() is to place, from the last frame's points alone, those
  /// that `witness` (1 or 0 per keypoint) names. Nothing without a map, when lost, or when too few points
  /// agree.
  [[nodiscard]] std::optional<SE3> first_pose(const Frame& frame, std::shared_ptr<const LocalMap> map,
                                              std::span<const std::uint8_t> witness);
  /// Places a frame in `map`, null as long as there is none. `grey` is its image, CV_8UC1; empty = lines
  /// are not looked for. `depth` is its depth image, CV_16UC1, raw units; empty = lines have no measured
  /// depth. `weights` says how much each feature counts; those of weight 0 and those in dynamic regions are
  /// not used. Without a map the state is kInitializing with an identity pose; the frame can start the map
  /// when can_start_map says so.
  [[nodiscard]] TrackedFrame track(std::shared_ptr<const Frame> frame, std::shared_ptr<const LocalMap> map,
                                   const cv::Mat& grey = {}, const cv::Mat& depth = {},
                                   FeatureWeights weights = {});

  /// Whether the camera has been lost for so long that a new part of the map should be started.
  [[nodiscard]] bool given_up(double timestamp) const;
  /// Whether a frame has enough keypoints that count and lines with depth to start a map. `lines` may be
  /// null.
  [[nodiscard]] bool can_start_map(const Frame& frame, const LineFeatures* lines = nullptr,
                                   const FeatureWeights& weights = {}) const;
  /// The map, or a part of it, was started with this frame at the origin.
  void start(const TrackedFrame& first);
  /// The frame tracked last went into the map under this id: from now on its pose is the keyframe's.
  void became_keyframe(KeyframeId id);
  /// Where the camera is expected to be at a time after the last tracked frame (T_wc); nothing without a
  /// map or while it is lost.
  [[nodiscard]] std::optional<SE3> expected_pose(double timestamp) const;
  /// From the world of the map to a frame of reference that corrections of the whole map do not move: in it
  /// the camera's path has no jumps as long as the camera is not lost.
  [[nodiscard]] const SE3& T_ow() const { return T_ow_; }
  /// Hands over what was counted since the last call.
  [[nodiscard]] std::vector<Sighting<PointId>> take_sightings() { return points_seen_.take(); }
  [[nodiscard]] std::vector<Sighting<LineId>> take_line_sightings() { return lines_seen_.take(); }

 private:
  /// The frame being tracked and its images.
  struct View {
    const Frame& frame;
    const cv::Mat& grey;
    const cv::Mat& depth;
    const FeatureWeights& weights;
    std::vector<std::uint8_t> removed;  // per keypoint: 1 = weight 0
  };
  /// A pose with the landmarks that support it, as indices into LocalMap::points and lines.
  struct Placement {
    SE3 T_cw;
    std::vector<int> points = {};         // per keypoint; -1 = none
    std::vector<int> visible = {};        // all that should show in the image
    int inliers = 0;                      // of the points
    std::vector<LineSight> lines = {};    // inliers
    double deviation = 0.0;               // of the pose in its least certain direction, m or rad
    std::vector<int> visible_lines = {};  // all that should show in the image
  };

  void adopt(std::shared_ptr<const LocalMap> map);
  [[nodiscard]] std::optional<SE3> carried_over(const LocalMap& to) const;
  [[nodiscard]] Placement match_widening(const View& view, const SE3& T_cw) const;
  [[nodiscard]] Placement place_by_prediction(const View& view) const;
  [[nodiscard]] Placement match_last_frame(const View& view, const SE3& T_cw, double radius) const;
  [[nodiscard]] Placement place_by_lines(const View& view, const SE3& T_cw) const;
  [[nodiscard]] Placement place_at(const View& view, const SE3& T_cw) const;
  [[nodiscard]] Placement place_from(const View& view, const Frame& earlier, const SE3& T_earlier_w) const;
  [[nodiscard]] Placement relocalize(const View& view) const;
  void keep_better(Placement& best, Placement other) const;
  [[nodiscard]] bool lost() const { return frames_lost_ > 0; }
  [[nodiscard]] Placement place_in_local_map(const View& view, const Placement& start, double radius) const;
  [[nodiscard]] bool hidden(const View& view, const Eigen::Vector2d& uv) const;
  [[nodiscard]] bool hidden(const View& view, const Eigen::Vector2d& start, const Eigen::Vector2d& end) const;
  [[nodiscard]] LineSights look_for_lines(const View& view, const SE3& T_cw, double radius) const;
  void count_sightings(const Placement& placement);
  /// What speaks for a pose, counted in points.
  [[nodiscard]] double support(const Placement& placement) const;
  /// Whether a pose counts as tracked.
  [[nodiscard]] bool believed(const Placement& placement) const;
  [[nodiscard]] TrackedFrame conclude(std::shared_ptr<const Frame> frame, const Placement& placement,
                                      FeatureWeights weights);
  [[nodiscard]] const LocalKeyframe& most_shared_keyframe(const Placement& placement) const;

  Camera camera_;
  ScalePyramid pyramid_;
  TrackerOptions options_;
  PoseOptimizer optimizer_;
  Visibility visibility_;
  LineVisibility line_visibility_;
  LineTracker line_tracker_;
  Relocalizer relocalizer_;
  MotionModel motion_;

  std::shared_ptr<const LocalMap> map_;
  TrackedFrame last_;            // the last frame that was tracked
  bool last_is_here_ = false;    // whether its pose is one in the world of map_
  std::size_t frames_lost_ = 0;  // in a row, up to now
  double lost_since_ = 0.0;      // timestamp of the first of these
  SE3 T_ow_;
  SightingCounter<PointId> points_seen_;
  SightingCounter<LineId> lines_seen_;
};

}  // namespace ipl_slam
