#pragma once

#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "common/ids.hpp"
#include "common/options.hpp"
#include "segmentation/appearance.hpp"
#include "segmentation/instance.hpp"
#include "segmentation/mask_carrier.hpp"

namespace ipl_slam {

/// When a detection is taken for an instance seen before, and how long that one is remembered.
struct InstanceTrackerOptions {
  double min_overlap = 0.2;    ///< IoU of carried mask and detection from which on they can be one
  double other_class = 0.5;    ///< what overlap counts if the class is another one
  double duplicate_iou = 0.6;  ///< IoU of two detections from which on they are one object
  double part_inside = 0.6;  ///< share of a mask inside another of its class from which on it is a part of it
  double body_depth = 0.3;   ///< parts of one body differ less in depth, m
  double min_similarity = 0.6;  ///< of colours, to be recognised after being out of sight
  double max_speed = 2.0;       ///< of somebody out of sight, m/s; things stay where they were
  int max_carried = 30;         ///< a mask is not carried on for longer without being seen, frames
  int max_out_of_sight = 90;    ///< who is gone for longer is forgotten, frames
  double min_support = 0.2;     ///< share of a mask's points that must be found again for it to be carried on
  double min_depth_fit = 0.4;   ///< share of a carried mask that must have the instance's depth
  double min_area = 0.25;       ///< share of the area last seen below which a carried mask is given up

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("min_overlap", min_overlap,
             {0.01, 1.0, "", "IoU of carried mask and detection from which on they can be one instance"});
    v.number("other_class", other_class,
             {0.0, 1.0, "", "factor on the overlap where the class differs (people never become things)"});
    v.number("duplicate_iou", duplicate_iou,
             {0.1, 1.0, "", "IoU of two detections from which on they are one object"});
    v.number(
        "part_inside", part_inside,
        {0.1, 1.0, "", "share of a mask inside another of its class from which on it is a part of that"});
    v.number("body_depth", body_depth, {0.0, 10.0, "m", "parts of one body differ less in depth"});
    v.number("min_similarity", min_similarity,
             {0.0, 1.0, "", "likeness of colours needed to be recognised after being out of sight"});
    v.number(
        "max_speed", max_speed,
        {0.0, 100.0, "m/s",
         "largest speed of somebody out of sight; what does not move by itself is looked for where it was"});
    v.number("max_carried", max_carried,
             {0, 1000, "frame", "a mask is carried on no longer than this without being seen"});
    v.number("max_out_of_sight", max_out_of_sight,
             {0, 100000, "frame", "an instance out of sight for longer is forgotten"});
    v.number("min_support", min_support,
             {0.0, 1.0, "", "share of a mask's points that must be found again for it to be carried on"});
    v.number("min_depth_fit", min_depth_fit,
             {0.0, 1.0, "", "share of a carried mask that must have the instance's depth"});
    v.number("min_area", min_area,
             {0.0, 1.0, "", "share of the area last seen below which a carried mask is given up"});
  }
};

/// Gives instances an identity over frames. The masks of the frame before are carried to the new one
/// (MaskCarrier) and paired with its detections, best sum of overlaps first (assign). One body in two
/// detections is joined, two bodies in one detection are parted by the masks that were carried. Who is not
/// detected is carried on while flow and depth support the mask, then remembered out of sight, and recognised
/// there by colours and place (3-D where there is depth). The class is the one with the largest sum of
/// scores.
///
/// A tracker is a plain value. Where detections come late, keep one at the last segmented frame: copy it,
/// carry the copy through the views up to the present, and put it in the place of the one in use.
class InstanceTracker {
 public:
  explicit InstanceTracker(const Camera& camera, const InstanceTrackerOptions& options = {},
                           const MaskCarrierOptions& carrier = {})
      : camera_(camera), options_(options), carrier_(camera, carrier) {}

  /// What the other calls need of a frame.
  [[nodiscard]] CarryView view(const RgbdFrame& frame) const { return carrier_.view(frame); }

  /// A frame with detections. Frames must come in order; T_to_from: the camera's motion since the frame of
  /// the last call (camera coordinates there into those here), or null where it is not known. Returns the
  /// instances in view in the order of their ids: detected ones and those that are carried on.
  std::vector<TrackedInstance> update(const CarryView& view, const std::vector<Instance>& detections,
                                      const SE3* T_to_from = nullptr);
  /// A frame that was not segmented.
  std::vector<TrackedInstance> carry(const CarryView& view, const SE3* T_to_from = nullptr);

 private:
  struct Track {
    InstanceId id;
    std::map<std::string, float> votes;  // sum of scores per class
    float score = 0.0F;                  // of the last detection
    BitMask mask;                        // empty: out of sight
    int seen_area = 0;                   // when last detected, pixels
    Appearance appearance;
    Eigen::Vector3d place{0, 0, 0};  // in the camera's frame, m; z = 0: not known
    int detections = 0;
    int misses = 0;          // segmented frames in a row without it
    int frames_carried = 0;  // frames since it was last detected
    double seen_at = 0.0;    // when it was last detected, s
    bool hidden = false;     // not detected itself, but part of what was detected as another

    [[nodiscard]] bool in_sight() const { return mask.size().area() > 0; }
    [[nodiscard]] const std::string& class_name() const;
  };
  /// A detection with what is compared.
  struct Candidate {
    Instance instance;
    Appearance appearance;
    Eigen::Vector3d place{0, 0, 0};
    int track = -1;
  };
  using Score = double (InstanceTracker::*)(const Track&, const Candidate&) const;

  void advance(const CarryView& view, const SE3* T_to_from);
  [[nodiscard]] std::vector<Instance> without_duplicates(const std::vector<Instance>& detections) const;
  [[nodiscard]] std::vector<Candidate> candidates(const CarryView& view,
                                                  std::vector<Instance> detections) const;
  void associate(std::vector<Candidate>& candidates, bool in_sight, Score score) const;
  [[nodiscard]] double overlap(const Track& track, const Candidate& candidate) const;
  [[nodiscard]] double resemblance(const Track& track, const Candidate& candidate) const;
  [[nodiscard]] double reach_of(const Track& track) const;
  void join_parts(std::vector<Candidate>& candidates) const;
  void part_bodies(std::vector<Candidate>& candidates);
  [[nodiscard]] bool shows_part(const Track& track, const Candidate& candidate) const;
  void confirm(Track& track, const Candidate& candidate);
  void miss(Track& track, const std::vector<Candidate>& candidates);
  [[nodiscard]] Eigen::Vector3d place_of(const CarryView& view, const BitMask& mask) const;
  [[nodiscard]] std::vector<TrackedInstance> in_view() const;

  Camera camera_;
  InstanceTrackerOptions options_;
  MaskCarrier carrier_;
  CarryView view_;             // of the last call
  std::vector<Track> tracks_;  // by id
  std::uint32_t next_id_ = 0;
};

}  // namespace ipl_slam
