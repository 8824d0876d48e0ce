#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "common/thread_pool.hpp"
#include "dataset/rgbd_frame.hpp"
#include "dataset/trajectory.hpp"
#include "dynamics/dynamic_features.hpp"
#include "features/image_noise.hpp"
#include "features/orb_extractor.hpp"
#include "mapping/keyframe_policy.hpp"
#include "pipeline/config.hpp"
#include "pipeline/dense_schedule.hpp"
#include "pipeline/instance_record.hpp"
#include "pipeline/instance_schedule.hpp"
#include "pipeline/mapping_schedule.hpp"
#include "tracking/tracker.hpp"

namespace ipl_slam {

/// What a frame cost, milliseconds of wall-clock time.
struct FrameTimes {
  double features = 0.0;   ///< colour image to keypoints and descriptors; before there is a map, lines too
  double instances = 0.0;  ///< instances found (lockstep), carried to the frame and handed on
  double dynamics = 0.0;   ///< what moves, and a first pose to tell it by
  double tracking = 0.0;   ///< keypoints and known lines to pose
};

/// What became of a frame.
struct FrameResult {
  TrackingState state = TrackingState::kInitializing;
  SE3 T_wc;  ///< camera-to-world as known now; the trajectory at the end is better
  std::size_t keypoints = 0;
  int inliers = 0;  ///< points that agree with the pose
  int lines = 0;    ///< lines that do
  bool keyframe = false;
  int mask_age = -1;  ///< source frames since the picture the masks were made from; -1 = there are none
  std::vector<InstanceRecord> instances;
  FrameTimes times;
};

/// The whole system: frames in, poses and map out. The order of the stages is that of process(); which thread
/// the mapper runs on is the business of its schedule.
class Pipeline {
 public:
  /// Goes on with `loaded`, if there is a map: the camera is lost until it sees a place of it, and the world
  /// is the map's. With `localize_only` the map stays as it is: nothing is added, nor is a part begun. Throws
  /// std::invalid_argument for `localize_only` without a map.
  Pipeline(const Camera& camera, const Config& config, std::optional<Map> loaded = std::nullopt,
           bool localize_only = false);

  /// Frames must come in order of time and have the camera's size; throws std::invalid_argument otherwise.
  FrameResult process(const RgbdFrame& image);
  /// Waits for the stages on other threads. To be called before the results below.
  void finish();

  /// Camera-to-world poses of all tracked frames, with every correction made since; lost frames have none.
  /// One list per part of the map that frames were tracked in, the longest first: where the others lie
  /// relative to it was never found out. Never empty.
  [[nodiscard]] std::vector<TrajectoryPart> trajectory_parts() const;
  /// The same of the keyframes that were made, not loaded; the part that has most of the frames comes first.
  [[nodiscard]] std::vector<TrajectoryPart> keyframe_parts() const;
  /// The first of these parts.
  [[nodiscard]] Trajectory trajectory() const { return trajectory_parts().front().poses; }
  [[nodiscard]] Trajectory keyframe_trajectory() const { return keyframe_parts().front().poses; }
  [[nodiscard]] const MappingSchedule& mapping() const { return *mapping_; }
  [[nodiscard]] const InstanceSchedule& instances() const { return *instances_; }
  [[nodiscard]] const Camera& camera() const { return camera_; }
  /// Null where no dense map is made: with dense.enabled off, and with `localize_only`.
  [[nodiscard]] const DenseSchedule* dense() const { return dense_.get(); }
  /// Makes the cloud of the static world, with all that is known at the end, in the world of the first of
  /// trajectory_parts(). To be called after finish(), and where dense() is not null. Calls `progress` three
  /// times a keyframe. Throws UserError where the disk failed that the keyframes' images are kept on.
  [[nodiscard]] DenseMap::Result fuse(const std::function<void()>& progress = {});
  /// The surface of what was fused last.
  [[nodiscard]] TriangleMesh mesh(const SemanticCloud& cloud) const { return dense_->dense().mesh(cloud); }
  /// The frame that was processed last, with the features that agree with its pose.
  [[nodiscard]] const TrackedFrame& last_tracked() const { return last_tracked_; }
  /// The instances of that frame, with their masks.
  [[nodiscard]] const std::vector<TrackedInstance>& last_instances() const { return last_instances_; }

 private:
  // A tracked frame's place relative to a keyframe.
  struct Placed {
    double timestamp;
    KeyframeId reference;
    SE3 T_c_reference;
  };

  /// Places a frame whose camera is lost, if its place is known: in the local map around it then.
  [[nodiscard]] TrackedFrame recover(TrackedFrame lost, std::shared_ptr<const LocalMap>& map,
                                     const cv::Mat& grey, const cv::Mat& depth);
  /// Submits the frame to the map if it should be a keyframe.
  bool submit(TrackedFrame& tracked, const LocalMap& map, const cv::Mat& grey, const cv::Mat& depth);
  /// Starts the map, or a new part of it, with this frame if it shows enough.
  bool start_map(TrackedFrame& first, const cv::Mat& grey, const cv::Mat& depth, FrameTimes& times);
  /// Hands a frame that became a keyframe to the dense map.
  void keep_view(const RgbdFrame& image, const TrackedFrame& tracked);
  [[nodiscard]] std::vector<InstanceRecord> instance_records() const;

  Camera camera_;
  ThreadPool threads_;
  ImageNoise noise_;
  OrbExtractor extractor_;
  std::optional<LineExtractor> first_lines_;  // of the frame that starts the map; none without lines
  std::unique_ptr<InstanceSchedule> instances_;
  DynamicFeatures dynamics_;
  Tracker tracker_;
  KeyframePolicy policy_;
  std::unique_ptr<MappingSchedule> mapping_;
  std::unique_ptr<DenseSchedule> dense_;  // after mapping_, which it reads
  double dense_tolerance_ = 0.0;          // m
  bool localize_only_;
  KeyframeId first_made_;  // all before it were loaded
  std::vector<Placed> placed_;
  TrackedFrame last_tracked_;
  std::vector<TrackedInstance> last_instances_;
  std::uint32_t next_keyframe_;  // the mapper numbers them in the order they are submitted
  double last_timestamp_;
};

}  // namespace ipl_slam
