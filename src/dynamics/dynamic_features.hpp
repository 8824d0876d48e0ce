#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/options.hpp"
#include "dynamics/feature_weights.hpp"
#include "dynamics/line_motion_check.hpp"
#include "dynamics/point_motion_check.hpp"
#include "dynamics/region_belief.hpp"
#include "features/frame.hpp"
#include "geometry/se3.hpp"
#include "segmentation/instance.hpp"

namespace ipl_slam {

struct DynamicsOptions {
  std::string rule = "evidence";
  int growth = 10;
  double region_share = 0.2;
  double min_gap = 0.1;
  int min_witnesses = 100;
  std::string weights = "distance";
  double min_weight = 0.05;
  double max_feature_factor = 2.0;
  PointMotionOptions points;
  LineMotionOptions lines;
  RegionBeliefOptions belief;

  template <class Visitor>
  void visit(Visitor& v) {
    v.choice("rule", rule, {"off", "contours", "algorithm1", "evidence"},
             "which regions are dynamic, so that their features are removed: contours = those the contour "
             "window found moving; algorithm1 = these, and those with enough dynamic points as well as lines "
             "(paper); evidence = by all that is known, see belief");
    v.number("growth", growth, {0, 100, "px", "radius of the disc by which dynamic regions grow"});
    v.number("region_share", region_share,
             {0.0, 1.0, "share", "algorithm1: dynamic points, or lines, a region must have of all it has"});
    v.number(
        "min_gap", min_gap,
        {0.0, 10.0, "s",
         "between the frames whose points are compared, at least; 0: consecutive frames (paper), in which "
         "somebody slow has hardly moved"});
    v.number(
        "min_witnesses", min_witnesses,
        {0, 10000, "count",
         "points with depth outside the regions that may move; with fewer, those in regions believed to be "
         "still are witnesses as well, and nobody is removed for his class alone"});
    v.choice(
        "weights", weights, {"off", "distance", "residual"},
        "how much each point may say: off = all alike; distance = by the distance it moved beside that of "
        "the others (paper); residual = by its residual beside its own noise");
    v.number("min_weight", min_weight, {0.0, 1.0, "1", "a point with a smaller weight is dropped"});
    v.number("max_feature_factor", max_feature_factor,
             {1.0, 10.0, "1",
              "largest factor by which the number of points grows to make up for those in dynamic regions"});
    v.section("points", points, "which points move");
    v.section("lines", lines, "which lines move");
    v.section("belief", belief, "evidence: what speaks for motion, and how loud");
  }
};

/// The paper's own: Algorithm 1 beside the contour window, epipolar distances, angles, weights by distance.
[[nodiscard]] DynamicsOptions paper_dynamics();

/// Lines of a keyframe in a region.
struct RegionLines {
  InstanceId region;
  int lines = 0, moved = 0;
};

/// Decides for every frame which features may say where the camera is (paper, sections 3.4 and 3.5): in
/// order, locate() says which points lie outside everything that may move, a first pose comes from these,
/// decide() takes it to tell what moves by itself, and placed() hands over where the frame was in the end.
class DynamicFeatures {
 public:
  using Verdict = std::function<MotionState(InstanceId)>;

  DynamicFeatures(const Camera& camera, const ScalePyramid& pyramid, const DynamicsOptions& options,
                  std::uint64_t seed = 0);

  /// The instances of the next frame, masks as they lie in it. Returns 1 per keypoint that lies outside all
  /// regions that may move: witnesses of the camera's motion.
  [[nodiscard]] const std::vector<std::uint8_t>& locate(std::shared_ptr<const Frame> frame,
                                                        const std::vector<TrackedInstance>& instances);
  /// Weights of that frame's features. T_cw: a first pose from the witnesses, where there is one; `contour`:
  /// what the contour window says of an instance.
  [[nodiscard]] FeatureWeights decide(const std::optional<SE3>& T_cw, const Verdict& contour);
  /// By how much more points the next frame should have, for as many to be left as there are without anything
  /// dynamic: 1 / (1 - share of the image that was removed from the last).
  [[nodiscard]] double feature_factor() const { return feature_factor_; }
  /// Where that frame was placed; nothing where the camera is lost.
  void placed(const std::optional<SE3>& T_cw);
  /// What the lines of the newest keyframe tell about the regions in it.
  void add_lines(std::vector<RegionLines> lines) {
    if (!lines.empty()) lines_ = std::move(lines);
  }

 private:
  struct Placed {
    std::shared_ptr<const Frame> frame;
    SE3 T_cw;
  };

  [[nodiscard]] int call_witnesses(const std::function<bool(const TrackedInstance&)>& may_move);
  [[nodiscard]] PointMotion point_motion(const std::optional<SE3>& T_cw) const;
  [[nodiscard]] double moved_witnesses(const PointMotion& motion) const;
  [[nodiscard]] RegionEvidence evidence_on(InstanceId id, const PointMotion& motion,
                                           const Verdict& contour) const;
  [[nodiscard]] RegionVerdict judge(const TrackedInstance& instance, const RegionEvidence& evidence);
  [[nodiscard]] bool by_algorithm1(const RegionEvidence& evidence) const;
  void weigh(const PointMotion& motion, FeatureWeights& weights) const;

  DynamicsOptions options_;
  PointMotionCheck points_;
  RegionBelief belief_;
  std::vector<RegionLines> lines_;  // news of the last keyframe
  std::deque<Placed> before_;       // the last frames, the one to compare with first

  // Of the present frame.
  std::shared_ptr<const Frame> frame_;
  std::vector<TrackedInstance> instances_;
  std::vector<InstanceId> region_of_;  // per keypoint; invalid = none
  std::vector<std::uint8_t> witness_;  // per keypoint
  double feature_factor_ = 1.0;
  bool enough_witnesses_ = false;  // outside all that may move
};

}  // namespace ipl_slam
