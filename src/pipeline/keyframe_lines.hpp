#pragma once

#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "dynamics/dynamic_features.hpp"
#include "features/line_extractor.hpp"
#include "tracking/tracked_frame.hpp"

namespace ipl_slam {

/// A keyframe on its way to the mapper, with the images its lines are extracted from. Where the candidate has
/// its lines already they are not extracted again.
struct NewKeyframe {
  KeyframeCandidate candidate;
  cv::Mat grey;                    ///< CV_8UC1
  cv::Mat depth;                   ///< raw units
  double line_milliseconds = 0.0;  ///< what the lines took, once they are there
};

/// Extracts the lines of keyframes, one after the other, and tells by the keyframe before which of them move.
class KeyframeLines {
 public:
  /// A segment with more than `max_dynamic_share` of its length in dynamic regions is removed.
  KeyframeLines(LineExtractor extractor, LineMotionCheck check, double max_dynamic_share)
      : extractor_(std::move(extractor)), check_(std::move(check)), max_dynamic_share_(max_dynamic_share) {}

  /// Gives the keyframe its lines and how far each is to be trusted. Returns what they tell about its
  /// regions.
  std::vector<RegionLines> process(NewKeyframe& keyframe);

 private:
  [[nodiscard]] LineMotion motion_of(const KeyframeCandidate& candidate) const;

  LineExtractor extractor_;
  LineMotionCheck check_;
  double max_dynamic_share_;
  std::shared_ptr<const LineFeatures> before_;  // of the last keyframe; null at the first
  SE3 T_before_w_;
};

}  // namespace ipl_slam
