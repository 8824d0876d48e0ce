#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "common/options.hpp"
#include "dataset/rgbd_frame.hpp"
#include "geometry/camera.hpp"
#include "geometry/se3.hpp"
#include "segmentation/bit_mask.hpp"

namespace ipl_slam {

/// How masks are carried along. Pixels are those of the full image unless said otherwise.
struct MaskCarrierOptions {
  int points = 40;              ///< tracked in every mask
  int window = 11;              ///< side of the patch around a point, pixels of the halved image
  double max_round_trip = 1.0;  ///< forth and back, a point must return this near to its start, pixels
  int min_points = 6;           ///< fewer cannot tell a motion from noise
  double reach = 24.0;          ///< around a point its own motion counts, pixels
  double max_shift = 0.25;      ///< by which an instance can have moved, share of the image's width
  double depth_slack = 0.15;    ///< between two frames depth of the same surface changes less, m
  int growth = 24;              ///< how far a mask may grow into what came into view, pixels

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("points", points, {8, 1000, "count", "points tracked in every mask"});
    v.number("window", window, {5, 31, "pixel", "side of the patch around a point, in the halved image"});
    v.number("max_round_trip", max_round_trip,
             {0.1, 10.0, "pixel", "a point tracked forth and back must return this near to its start"});
    v.number("min_points", min_points, {3, 100, "count", "tracked points a mask's motion needs"});
    v.number("reach", reach,
             {1.0, 1000.0, "pixel", "how far around it a point's own motion counts, beyond the mask's"});
    v.number("max_shift", max_shift,
             {0.0, 1.0, "", "largest shift of an instance, share of the image's width"});
    v.number("depth_slack", depth_slack,
             {0.01, 2.0, "m", "change of depth from which on a pixel shows something else"});
    v.number("growth", growth,
             {0, 200, "pixel", "how far a mask may grow into parts of the instance that came into view"});
  }
};

/// What carrying needs of a frame; made once per frame.
struct CarryView {
  std::size_t index = 0;         ///< of the frame
  double timestamp = 0.0;        ///< of the frame, s
  std::optional<SE3> T_wc;       ///< camera to world, as far as it is known
  std::vector<cv::Mat> pyramid;  ///< of the halved grey image, as cv::buildOpticalFlowPyramid makes it
  cv::Mat color;                 ///< the frame's, halved
  cv::Mat depth;                 ///< CV_16UC1, raw, the frame's own
  cv::Mat coarse_grey;           ///< an eighth of the frame's size
  cv::Mat coarse_depth;          ///< the same, without interpolation
};

/// The camera's motion between two views: maps points of the camera frame of `from` into that of `to`.
/// Nothing where the pose of either is not known.
[[nodiscard]] std::optional<SE3> motion_between(const CarryView& from, const CarryView& to);

/// A mask as it lies in another frame.
struct CarriedMask {
  BitMask mask;
  bool followed = false;   ///< enough points were found again; otherwise it moved by the coarse shift alone
  double support = 0.0;    ///< share of its points that were found again, 0 to 1
  double depth_fit = 1.0;  ///< share of the moved mask's pixels that still have the instance's depth, 0 to 1
};

/// Brings masks of one frame to another. Each mask
/// 1. is laid where grey and depth of a coarse image fit best, a shift;
/// 2. moves with its own points, tracked from there by pyramidal Lucas-Kanade (Bouguet, "Pyramidal
///    implementation of the Lucas Kanade feature tracker", 2000) forth and back (Kalal et al.,
///    "Forward-backward error", ICPR 2010), as a MotionField: arms and legs go their own way;
/// 3. loses the pixels whose depth is not the instance's (an uncovered background, someone who steps before
///    it) and gains those next to it that have the instance's depth and had another one, or were out of the
///    image, before: parts that came into view.
class MaskCarrier {
 public:
  explicit MaskCarrier(const Camera& camera, const MaskCarrierOptions& options = {})
      : camera_(camera), options_(options) {}

  /// Throws std::invalid_argument for images that are not of the camera's size.
  [[nodiscard]] CarryView view(const RgbdFrame& frame, const std::optional<SE3>& T_wc = {}) const;

  /// The masks of `from` as they lie in `to`, in the same order. Where both views have a pose the camera's
  /// motion says where to look first.
  [[nodiscard]] std::vector<CarriedMask> carry(const CarryView& from,
                                               const std::vector<const BitMask*>& masks,
                                               const CarryView& to) const;

 private:
  Camera camera_;
  MaskCarrierOptions options_;
};

}  // namespace ipl_slam
