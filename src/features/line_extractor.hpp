#pragma once

#include <cstdint>

#include <opencv2/core.hpp>

#include "common/options.hpp"
#include "features/line_descriptor.hpp"
#include "features/line_detector.hpp"
#include "features/line_features.hpp"
#include "features/segment_depth.hpp"
#include "geometry/camera.hpp"
#include "geometry/depth_noise.hpp"

namespace ipl_slam {

/// Settings of the line stage.
struct LineOptions {
  LineDetectorOptions detector;
  LineDescriptorOptions descriptor;
  SegmentDepthOptions depth;

  template <class Visitor>
  void visit(Visitor& v) {
    v.section("detector", detector, "segments in the image");
    v.section("descriptor", descriptor, "LBD descriptors");
    v.section("depth", depth, "depth along a segment");
  }
};

/// Lines of a keyframe: detect, describe, measure their depth. One instance per thread.
class LineExtractor {
 public:
  /// Every random choice depends on `seed`.
  LineExtractor(LineMethod method, const LineOptions& options, const Camera& camera,
                const DepthNoiseOptions& noise, std::uint64_t seed = 0);

  /// `grey` is CV_8UC1, `depth` CV_16UC1 in raw units or empty for none; both of the camera's size.
  [[nodiscard]] LineFeatures extract(const cv::Mat& grey, const cv::Mat& depth);

 private:
  Camera camera_;
  DepthNoiseOptions noise_;
  LineOptions options_;
  std::uint64_t seed_;
  LineDetector detector_;
};

}  // namespace ipl_slam
