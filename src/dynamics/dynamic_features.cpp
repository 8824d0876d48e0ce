#include "dynamics/dynamic_features.hpp"

#include <algorithm>

#include "dynamics/adaptive_weights.hpp"
#include "segmentation/class_role.hpp"

namespace ipl_slam {
namespace {

// Three to one.
constexpr double kBelievedStill = -1.0;

// Who is out of sight for longer is believed no more of than of a stranger; as long as contours are
// remembered.
constexpr std::size_t kForgetAfter = 300;

// Of a point's residual: two pixels and an inverse depth.
constexpr int kPointComponents = 3;

}  // namespace

DynamicsOptions paper_dynamics() {
  DynamicsOptions options;
  options.rule = "algorithm1";
  options.weights = "distance";
  options.min_gap = 0.0;
  options.max_feature_factor = 1.0;
  options.points.check = "epipolar";
  options.lines.check = "angle";
  return options;
}

DynamicFeatures::DynamicFeatures(const Camera& camera, const ScalePyramid& pyramid,
                                 const DynamicsOptions& options, std::uint64_t seed)
    : options_(options), points_(camera, pyramid, options.points, seed), belief_(options.belief) {}

const std::vector<std::uint8_t>& DynamicFeatures::locate(std::shared_ptr<const Frame> frame,
                                                         const std::vector<TrackedInstance>& instances) {
  frame_ = std::move(frame);
  instances_ = instances;
  const auto old_enough = [&](const Placed& p) {
    return frame_->timestamp - p.frame->timestamp >= options_.min_gap;
  };
  while (before_.size() > 1 && old_enough(before_[1])) before_.pop_front();
  const std::vector<Keypoint>& keypoints = frame_->features.keypoints;
  region_of_.assign(keypoints.size(), InstanceId{});
  for (std::size_t k = 0; k < keypoints.size(); ++k) {
    const auto in = std::find_if(instances_.begin(), instances_.end(), [&](const TrackedInstance& i) {
      return covers(i.instance.mask, keypoints[k].pixel.cast<double>());
    });
    if (in != instances_.end()) region_of_[k] = in->id;
  }
  const auto not_background = [](const TrackedInstance& i) {
    return class_role(i.instance.class_name) != ClassRole::background;
  };
  const auto not_known_still = [&](const TrackedInstance& i) {
    return belief_.of(i.id, i.instance.class_name) > kBelievedStill;
  };
  enough_witnesses_ = call_witnesses(not_background) >= options_.min_witnesses;
  if (!enough_witnesses_) (void)call_witnesses(not_known_still);
  return witness_;
}

// Everything outside what may move bears witness. Returns how many of these points have depth.
int DynamicFeatures::call_witnesses(const std::function<bool(const TrackedInstance&)>& may_move) {
  const std::vector<Keypoint>& keypoints = frame_->features.keypoints;
  witness_.assign(keypoints.size(), 1);
  for (const TrackedInstance& i : instances_) {
    if (!may_move(i)) continue;
    for (std::size_t k = 0; k < keypoints.size(); ++k) {
      if (covers(i.instance.mask, keypoints[k].pixel.cast<double>())) witness_[k] = 0;
    }
  }
  int with_depth = 0;
  for (std::size_t k = 0; k < keypoints.size(); ++k)
    with_depth += witness_[k] && keypoints[k].depth > 0.0F ? 1 : 0;
  return with_depth;
}

PointMotion DynamicFeatures::point_motion(const std::optional<SE3>& T_cw) const {
  if (before_.empty()) {
    const std::size_t n = frame_->features.size();
    return {std::vector<std::uint8_t>(n, 0), std::vector<std::uint8_t>(n, 0),
            std::vector<std::optional<double>>(n), std::vector<std::optional<double>>(n)};
  }
  std::optional<SE3> T_now_before;
  if (T_cw) T_now_before = *T_cw * before_.front().T_cw.inverse();
  return points_.compare(*before_.front().frame, *frame_, T_now_before, witness_);
}

// Share of the witnesses that seem to move: what the first pose and the matching got wrong in this frame.
double DynamicFeatures::moved_witnesses(const PointMotion& motion) const {
  int judged = 0, moved = 0;
  for (std::size_t k = 0; k < witness_.size(); ++k) {
    if (!witness_[k] || !motion.judged[k]) continue;
    ++judged;
    moved += motion.dynamic[k];
  }
  return judged > 0 ? static_cast<double>(moved) / judged : 0.0;
}

RegionEvidence DynamicFeatures::evidence_on(InstanceId id, const PointMotion& motion,
                                            const Verdict& contour) const {
  RegionEvidence evidence{.contour = contour(id), .moved_elsewhere = moved_witnesses(motion)};
  for (std::size_t k = 0; k < region_of_.size(); ++k) {
    if (region_of_[k] != id || !motion.judged[k]) continue;
    ++evidence.points;
    evidence.moved_points += motion.dynamic[k];
  }
  for (const RegionLines& lines : lines_) {
    if (lines.region != id) continue;
    evidence.lines = lines.lines;
    evidence.moved_lines = lines.moved;
  }
  return evidence;
}

RegionVerdict DynamicFeatures::judge(const TrackedInstance& instance, const RegionEvidence& evidence) {
  RegionVerdict verdict{.evidence = evidence};
  const bool contour = evidence.contour == MotionState::kMoving;
  if (options_.rule == "contours") verdict.dynamic = contour;
  if (options_.rule == "algorithm1") verdict.dynamic = contour || by_algorithm1(evidence);
  if (options_.rule == "evidence") {
    const std::string& name = instance.instance.class_name;
    verdict.belief = belief_.update(instance.id, frame_->index, name, evidence);
    // With hardly anything else to go by, nobody is removed for what he is.
    const double presumption = enough_witnesses_ ? 0.0 : std::max(0.0, belief_.prior(name));
    verdict.dynamic = verdict.belief > presumption;
  }
  return verdict;
}

// Algorithm 1 of the paper: S1, regions with enough dynamic points, and S2, with enough dynamic lines, where
// lines are looked at.
bool DynamicFeatures::by_algorithm1(const RegionEvidence& evidence) const {
  const auto enough = [&](int moved, int all) { return all > 0 && moved >= options_.region_share * all; };
  return enough(evidence.moved_points, evidence.points) &&
         (options_.lines.check == "off" || enough(evidence.moved_lines, evidence.lines));
}

FeatureWeights DynamicFeatures::decide(const std::optional<SE3>& T_cw, const Verdict& contour) {
  const PointMotion motion = point_motion(T_cw);
  FeatureWeights weights;
  auto regions = std::make_shared<std::vector<Region>>();
  for (const TrackedInstance& instance : instances_) {
    const RegionEvidence evidence = evidence_on(instance.id, motion, contour);
    Region region{instance.id, instance.instance.mask, judge(instance, evidence)};
    if (region.verdict.dynamic) {
      region.mask = dilated(region.mask, options_.growth);
      if (weights.dynamic.size().empty()) weights.dynamic = BitMask(region.mask.size());
      weights.dynamic |= region.mask;
    }
    regions->push_back(std::move(region));
  }
  // Each keyframe is heard once; the paper's rule looks at the last one's lines until the next.
  if (options_.rule != "algorithm1") lines_.clear();
  belief_.forget_before(frame_->index - std::min(frame_->index, kForgetAfter));
  weights.regions = std::move(regions);
  weights.point_regions = region_of_;
  weigh(motion, weights);
  const double left = weights.dynamic.size().empty()
                          ? 1.0
                          : 1.0 - static_cast<double>(weights.dynamic.area()) / weights.dynamic.size().area();
  feature_factor_ = std::min(1.0 / std::max(left, 1e-3), options_.max_feature_factor);
  return weights;
}

void DynamicFeatures::weigh(const PointMotion& motion, FeatureWeights& weights) const {
  const std::vector<Keypoint>& keypoints = frame_->features.keypoints;
  weights.points.assign(keypoints.size(), 1.0);
  std::vector<std::optional<double>> distances = motion.distance;
  for (std::size_t k = 0; k < keypoints.size(); ++k) {
    if (weights.in_dynamic(keypoints[k].pixel.cast<double>())) {
      weights.points[k] = 0.0;
      distances[k].reset();  // it is not one of the points that are weighed
    }
  }
  std::vector<double> alpha(keypoints.size(), 1.0);
  if (options_.weights == "distance") alpha = point_weights(distances, options_.min_weight);
  if (options_.weights == "residual") {
    for (std::size_t k = 0; k < keypoints.size(); ++k) {
      if (motion.surprise[k])
        alpha[k] = residual_weight(*motion.surprise[k], kPointComponents, options_.points.threshold,
                                   options_.min_weight);
    }
  }
  for (std::size_t k = 0; k < keypoints.size(); ++k) weights.points[k] *= alpha[k];
}

void DynamicFeatures::placed(const std::optional<SE3>& T_cw) {
  if (!T_cw) {
    before_.clear();
    return;
  }
  before_.push_back({frame_, *T_cw});
}

}  // namespace ipl_slam
