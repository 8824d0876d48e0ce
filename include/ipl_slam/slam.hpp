#pragma once

// RGB-D SLAM, fed frame by frame. See examples/minimal.cpp for a whole program.
//
//   ipl_slam::Slam slam(ipl_slam::CameraParameters::preset("tum1"));
//   while (camera.grab(color, depth, timestamp)) {
//     const ipl_slam::TrackingResult result = slam.process(color, depth, timestamp);
//     if (result.state == ipl_slam::TrackingState::kTracking) use(result.T_wc);
//   }
//   slam.save_trajectory("trajectory.txt");
//   slam.save_cloud("cloud.ply");
//
// Units and frames: metres, seconds, pixels. The camera frame is x right, y down, z forward. The world frame
// is the camera frame of the first frame that was tracked, or, where a saved map was loaded, the world of
// that map. T_wc maps camera coordinates into the world: it is where the camera is, and how it is turned.
//
// A camera that stays lost (setting tracking.new_part_after) starts a new part of the map with a world frame
// of its own. When a place of another part is recognised the two become one, in the world of the older.

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

/// Where the settings come from, each over what stands before it (`ipl_slam config` prints all there are),
/// and the map to start from.
struct SlamOptions {
  std::string preset = "default";      ///< "default" (what measured best) or "paper" (what the paper says)
  std::string config_file;             ///< YAML file; empty = none
  std::vector<std::string> overrides;  ///< single settings, "orb.features=1200"
  /// A map that save_map() or `ipl_slam run --save-map` wrote, to go on with: the camera is lost until it
  /// sees a place of it, and poses are in that map's world then. Empty = start anew.
  std::string map_file;
  bool localize_only = false;  ///< leave that map as it is and only find the camera in it
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
  /// Valid while state is kTracking, in the world of the part of the map the camera is in; the last known
  /// pose while it is kLost. It jumps where a new part begins and where a recognised place corrects the map.
  Pose T_wc;
  int inliers = 0;                      ///< map points that the pose rests on
  bool keyframe = false;                ///< whether the frame was taken into the map
  std::vector<SeenInstance> instances;  ///< who is in the picture
  int mask_age = -1;  ///< frames since the picture their masks were made from; -1 = there are no masks yet
  int lines = 0;      ///< map lines that the pose rests on
};

/// One camera's SLAM. Frames are worked off in the order they come, each within process(), so that the same
/// frames and settings give the same bytes out, whatever the machine's speed. With the setting
/// "schedule.mode=realtime" segmentation and mapping run on threads of their own: process() returns sooner,
/// results depend on timing, and trajectory(), keyframes() and what is saved wait until the map is up to
/// date.
///
/// Thread-safety: one object must not be used by two threads at the same time; different objects are
/// independent. Movable, not copyable; a moved-from object may only be assigned to or destroyed.
class IPL_SLAM_API Slam {
 public:
  /// Throws UserError when the camera's parameters cannot be, when a setting is wrong, when its file cannot
  /// be read, or when the map file cannot be, is damaged or was made with another camera. Throws
  /// std::invalid_argument for `localize_only` without a map file.
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

  /// Poses of the frames that were tracked so far, in order of time and in one world: where the map is in
  /// parts, those of the part that most frames were tracked in. Poses of earlier frames follow the map when
  /// it is corrected, so they may differ from what process() gave for them.
  [[nodiscard]] std::vector<TimedPose> trajectory() const;
  /// Poses, in the same world, of those frames that were taken into the map, in order of time. What a loaded
  /// map brought along is not among them.
  [[nodiscard]] std::vector<TimedPose> keyframes() const;
  /// Writes trajectory() as a TUM trajectory file ("timestamp tx ty tz qx qy qz qw"): beside, then renamed,
  /// so that no half-written file is left. Throws UserError when it cannot be written.
  void save_trajectory(const std::filesystem::path& file) const;
  /// Writes the map, all parts of it, to a file that SlamOptions::map_file and `ipl_slam map` read; replaces
  /// the file like save_trajectory(), be it the one that was loaded. Throws UserError when it cannot be
  /// written, or while there is no map yet.
  void save_map(const std::filesystem::path& file) const;
  /// Fuses the static surfaces that the frames taken into the map saw, in the world of trajectory(), and
  /// writes them as a labelled point cloud: PLY, or PCD where the file's name ends in .pcd (docs/formats.md).
  /// Replaces the file like save_trajectory(). Takes some hundredths of a second per keyframe. Throws
  /// UserError when the file cannot be written, while there is no map yet, with the setting
  /// dense.enabled=false and with `localize_only`.
  void save_cloud(const std::filesystem::path& file) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ipl_slam
