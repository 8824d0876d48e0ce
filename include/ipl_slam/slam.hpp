#pragma once

// RGB-D SLAM, fed frame by frame. See examples/minimal.cpp for a whole program.
//
//   ipl_slam::Slam slam(ipl_slam::CameraParameters::preset("tum1"));
//   while (camera.grab(color, depth, timestamp)) {
//     const ipl_slam::TrackingResult result = slam.process(color, depth, timestamp);
//     if (result.state == ipl_slam::TrackingState::kTracking) use(result.T_wc);
//   }
//   slam.save_trajectory("trajectory.txt");
//
// Units and frames: metres, seconds, pixels. The camera frame is x right, y down, z forward. The world frame
// is the camera frame of the first frame that was tracked. T_wc maps camera coordinates into the world: it is
// where the camera is, and how it is turned.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <ipl_slam/error.hpp>
#include <ipl_slam/export.hpp>
#include <ipl_slam/motion_state.hpp>
#include <ipl_slam/tracking_state.hpp>
#include <ipl_slam/version.hpp>

namespace ipl_slam {

/// Where the camera is in the world (T_wc): position in metres and rotation as a unit quaternion. Same order
/// as in a TUM trajectory file.
struct Pose {
  double tx = 0.0, ty = 0.0, tz = 0.0;
  double qx = 0.0, qy = 0.0, qz = 0.0, qw = 1.0;
};

/// A pose with the time of its frame in seconds.
struct TimedPose {
  double timestamp = 0.0;
  Pose T_wc;
};

/// What is stored in the pixels of an image.
enum class PixelFormat {
  kBgr8,     ///< 3 bytes: blue, green, red (what OpenCV reads)
  kRgb8,     ///< 3 bytes: red, green, blue
  kGray8,    ///< 1 byte
  kDepth16,  ///< 2 bytes, unsigned, native byte order: depth along the optical axis, 0 = not measured
};

/// An image in the caller's memory, row by row from the top. Nothing is owned; it is read during the call
/// only.
struct ImageView {
  const void* data = nullptr;
  int width = 0, height = 0;     ///< pixels
  std::size_t stride_bytes = 0;  ///< from one row to the next; 0 = rows follow each other without a gap
  PixelFormat format = PixelFormat::kBgr8;
};

/// Pinhole camera with radial-tangential distortion (k1 k2 p1 p2 k3, as OpenCV and ROS define them). Depth
/// images are registered to the colour images: same size, same camera.
struct IPL_SLAM_API CameraParameters {
  int width = 640, height = 480;                            ///< image size, pixels
  double fx = 525.0, fy = 525.0, cx = 319.5, cy = 239.5;    ///< pixels; (0, 0) = centre of the first pixel
  double k1 = 0.0, k2 = 0.0, p1 = 0.0, p2 = 0.0, k3 = 0.0;  ///< distortion; all 0 = none
  double depth_scale = 5000.0;                              ///< raw depth units per metre

  /// "tum1", "tum2" or "tum3", the cameras of the TUM RGB-D benchmark's freiburg1, 2 and 3 sequences, or
  /// "bonn", that of the Bonn RGB-D Dynamic dataset. Throws UserError for another name.
  static CameraParameters preset(const std::string& name);
  /// Reads a YAML file with the keys width, height, fx, fy, cx, cy, depth_scale and, where the lens distorts,
  /// k1, k2, p1, p2, k3. Throws UserError naming the line of an unknown or wrong key.
  static CameraParameters load(const std::filesystem::path& file);
};

/// Where the settings come from, each over what stands before it. `ipl_slam config` prints all there are.
struct SlamOptions {
  std::string preset = "default";      ///< "default" (what measured best) or "paper" (what the paper says)
  std::string config_file;             ///< YAML file; empty = none
  std::vector<std::string> overrides;  ///< single settings, "orb.features=1200"
};

/// Somebody or something that the segmenter (setting segmentation.segmenter) found in the picture.
struct SeenInstance {
  std::uint32_t id = 0;                     ///< its own, kept from frame to frame
  std::string class_name;                   ///< "unknown" where the segmenter knows no classes
  float score = 0.0F;                       ///< confidence, 0 to 1
  int x = 0, y = 0, width = 0, height = 0;  ///< box, pixels
  MotionState state = MotionState::kCandidate;
};

/// What is known about the camera after a frame.
struct TrackingResult {
  TrackingState state = TrackingState::kInitializing;
  Pose T_wc;              ///< valid while state is kTracking; the last known pose while it is kLost
  int inliers = 0;        ///< map points that the pose rests on
  bool keyframe = false;  ///< whether the frame was taken into the map
  std::vector<SeenInstance> instances;  ///< who is in the picture
  int mask_age = -1;  ///< frames since the picture their masks were made from; -1 = there are no masks yet
  int lines = 0;      ///< map lines that the pose rests on
};

/// One camera's SLAM. Frames are worked off in the order they come, each within process(), so that the same
/// frames and settings give the same bytes out, whatever the machine's speed. With the setting
/// "schedule.mode=realtime" segmentation and mapping run on threads of their own: process() returns sooner,
/// results depend on timing, and trajectory(), keyframes() and save_trajectory() wait until the map is up to
/// date.
///
/// Thread-safety: one object must not be used by two threads at the same time; different objects are
/// independent. Movable, not copyable; a moved-from object may only be assigned to or destroyed.
class IPL_SLAM_API Slam {
 public:
  /// Throws UserError when the camera's parameters cannot be, when a setting is wrong or when its file cannot
  /// be read.
  explicit Slam(const CameraParameters& camera, const SlamOptions& options = {});
  ~Slam();
  Slam(Slam&&) noexcept;
  Slam& operator=(Slam&&) noexcept;

  /// Takes the next frame: a colour (kBgr8, kRgb8) or grey (kGray8) image, the depth image (kDepth16)
  /// registered to it and its time in seconds. Never throws for what is in the picture: a frame that cannot
  /// be placed gives kLost. Throws std::invalid_argument when an image is empty or of another size than the
  /// camera's, when its format is not one of those named, or when the timestamp is not finite and above the
  /// last frame's; the frame then counts as never given.
  TrackingResult process(const ImageView& color, const ImageView& depth, double timestamp);

  /// The mask of an instance in the last frame: width x height bytes, row by row from the top, 255 where the
  /// instance is and 0 elsewhere. Empty for an id that is not in that frame.
  [[nodiscard]] std::vector<std::uint8_t> instance_mask(std::uint32_t id) const;

  /// Poses of all frames that were tracked so far, in order of time. Poses of earlier frames follow the map
  /// when it is corrected, so they may differ from what process() gave for them.
  [[nodiscard]] std::vector<TimedPose> trajectory() const;
  /// Poses of the frames the map is built from, in order of time.
  [[nodiscard]] std::vector<TimedPose> keyframes() const;
  /// Writes trajectory() as a TUM trajectory file ("timestamp tx ty tz qx qy qz qw"): beside, then renamed,
  /// so that no half-written file is left. Throws UserError when it cannot be written.
  void save_trajectory(const std::filesystem::path& file) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ipl_slam
