#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "common/options.hpp"
#include "features/line_features.hpp"
#include "features/segment_joiner.hpp"
#include "geometry/camera.hpp"

namespace ipl_slam {

/// How segments are found. The setting features.lines chooses (pipeline/config.hpp).
enum class LineMethod {
  kLsd,  ///< Grompone von Gioi et al., "LSD: a line segment detector", IPOL 2012, through OpenCV
};

/// Settings of the line detector.
struct LineDetectorOptions {
  int octaves = 2;            ///< scales, each half the size of the one before
  double min_length = 25.0;   ///< pixels
  double min_contrast = 8.0;  ///< grey values
  int max_segments = 200;     ///< the longest are kept
  SegmentJoinerOptions joiner;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("octaves", octaves,
             {1, 4, "count", "scales of the image, each half the size of the one before"});
    v.number("min_length", min_length, {5.0, 1000.0, "px", "shorter segments are dropped"});
    v.number("min_contrast", min_contrast,
             {0.0, 255.0, "grey", "segments with a weaker mean step across them are dropped"});
    v.number("max_segments", max_segments, {1, 10000, "count", "the longest segments are kept"});
    v.section("joiner", joiner, "pieces of one edge that become one segment");
  }
};

/// Finds straight segments in an image.
class LineDetector {
 public:
  LineDetector(LineMethod method, const LineDetectorOptions& options, const Camera& camera);

  /// `grey` is CV_8UC1 of the camera's size (std::invalid_argument). Longest first; depth is not filled in.
  /// End points of joined segments can stick out of the image by a fraction of a pixel.
  [[nodiscard]] std::vector<LineSegment> detect(const cv::Mat& grey);

 private:
  LineMethod method_;
  LineDetectorOptions options_;
  Camera camera_;
};

}  // namespace ipl_slam
