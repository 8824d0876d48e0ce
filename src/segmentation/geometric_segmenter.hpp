#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/options.hpp"
#include "geometry/camera.hpp"
#include "segmentation/camera_motion.hpp"
#include "segmentation/free_space.hpp"
#include "segmentation/motion_belief.hpp"
#include "segmentation/segmenter.hpp"
#include "segmentation/working_grid.hpp"

namespace ipl_slam {

struct GeometricOptions {
  int grid_width = 160;           ///< cells per row of the working grid
  double threshold = 0.0;         ///< belief above which a cell counts as moving
  double min_area = 0.003;        ///< smaller regions are dropped, share of the image
  double min_conductance = 0.15;  ///< cells that pass less on to each other belong to different instances
  CameraMotionOptions camera_motion;
  FreeSpaceOptions free_space;
  MotionBeliefOptions belief;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("grid_width", grid_width, {16, 4096, "cells", "cells per row of the working grid"});
    v.number("threshold", threshold, {-1.0, 1.0, "", "belief above which a cell counts as moving"});
    v.number("min_area", min_area, {0.0, 1.0, "", "smaller regions are dropped, share of the image"});
    v.number("min_conductance", min_conductance,
             {0.0, 1.0, "", "cells that pass less on to each other belong to different instances"});
    v.section("camera_motion", camera_motion, "the camera's own motion");
    v.section("free_space", free_space, "what earlier frames saw to be free");
    v.section("belief", belief, "from single cells to surfaces that move");
  }
};

/// Finds what moves without a network: class-agnostic, from depth and motion alone. It estimates the camera's
/// motion itself, so nothing else has to be known. A mover that stops stays an instance until the frames that
/// saw it come are forgotten.
class GeometricSegmenter : public Segmenter {
 public:
  /// Every random choice depends on `seed`. Throws UserError for a camera or options that cannot be.
  explicit GeometricSegmenter(const Camera& camera, const GeometricOptions& options = {},
                              std::uint64_t seed = 0);

  /// Instances of class "unknown"; score: mean belief, scaled to 0 to 1. Nothing in the first frames, and
  /// while the camera's motion is not known. Throws std::invalid_argument for images that are not of the
  /// camera's size or of another type than RgbdFrame says.
  [[nodiscard]] std::vector<Instance> segment(const RgbdFrame& frame) override;
  [[nodiscard]] std::string name() const override { return "geometric"; }

  /// T_wc of the last frame as estimated here, if it is known; for inspection.
  [[nodiscard]] const std::optional<SE3>& camera_pose() const { return T_wc_; }
  /// What the last frame's cells were believed to be, see MotionBelief; for inspection.
  [[nodiscard]] const cv::Mat& belief() const { return last_belief_; }
  [[nodiscard]] const FreeSpaceEvidence& evidence() const { return last_evidence_; }

 private:
  [[nodiscard]] std::vector<Instance> instances(const cv::Mat& belief, const GridFrame& frame,
                                                const cv::Mat& depth, const Conductance& conductance,
                                                cv::Mat& moving) const;

  GeometricOptions options_;
  WorkingGrid grid_;
  CameraMotion camera_motion_;
  FreeSpaceMemory free_space_;
  MotionBelief belief_;
  std::optional<SE3> T_wc_;
  cv::Mat last_belief_;
  FreeSpaceEvidence last_evidence_{cv::Size()};
};

}  // namespace ipl_slam
