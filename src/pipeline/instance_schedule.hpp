#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dataset/rgbd_frame.hpp"
#include "dynamics/contour_window.hpp"
#include "dynamics/dynamic_spans.hpp"
#include "geometry/camera.hpp"
#include "geometry/se3.hpp"
#include "pipeline/config.hpp"
#include "segmentation/instance.hpp"

namespace ipl_slam {

/// The instances of a frame as they are known when it is tracked.
struct FrameInstances {
  std::vector<TrackedInstance> instances;  ///< masks as they lie in this frame
  int mask_age =
      -1;  ///< source frames since the picture the masks were made from; 0 = this one, -1 = none yet
};

/// What the instances cost, one value per time the step was taken, milliseconds.
struct InstanceTimes {
  std::vector<double> segmentation;  ///< an image to instances
  std::vector<double> tracks;        ///< instances to tracks
  std::vector<double> contours;      ///< tracks to verdicts
};

/// Where and when instances are segmented, followed and judged. The stages on either side do not know.
class InstanceSchedule {
 public:
  virtual ~InstanceSchedule() = default;

  /// The instances of a frame that is about to be tracked. T_wc: a guess of the camera's pose (camera to
  /// world), where there is one.
  [[nodiscard]] virtual FrameInstances see(const RgbdFrame& frame, const std::optional<SE3>& T_wc) = 0;
  /// Takes where the frame that was seen last was placed; nothing where the camera is lost.
  virtual void placed(const RgbdFrame& frame, const std::optional<SE3>& T_wc) = 0;
  /// The newest verdict on an instance of the picture.
  [[nodiscard]] virtual ContourVerdict verdict(InstanceId id) const = 0;
  /// Waits for what is under way.
  virtual void finish() = 0;
  /// What it cost, and the spans of frames in which instances moved, as found by the end of each. To be
  /// called after finish().
  [[nodiscard]] virtual const InstanceTimes& times() const = 0;
  [[nodiscard]] virtual const DynamicSpans& dynamic() const = 0;
  /// What the segmenter has to say to its user. To be called after finish().
  [[nodiscard]] virtual std::vector<std::string> remarks() const = 0;
};

/// Nothing is segmented with segmentation.segmenter "none". In lockstep all is done in see() and placed(), in
/// realtime segmentation and verdicts have a thread each: see() takes the newest masks there are and carries
/// them to the frame; it waits for the first ones only. Throws UserError where the segmenter cannot be had.
[[nodiscard]] std::unique_ptr<InstanceSchedule> make_instance_schedule(const Camera& camera,
                                                                       const Config& config);

}  // namespace ipl_slam
