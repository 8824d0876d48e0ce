#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "common/options.hpp"
#include "features/line_features.hpp"
#include "geometry/camera.hpp"

namespace ipl_slam {

/// How segments are found. The setting features.lines chooses (pipeline/config.hpp).
enum class LineMethod {
  kLsd,  ///< Grompone von Gioi et al., "LSD: a line segment detector", IPOL 2012, through OpenCV
};

/// Settings of the line detector.
struct LineDetectorOptions {
  int octaves = 2;           ///< scales, each half the size of the one before
  double min_length = 25.0;  ///< pixels

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("octaves", octaves,
             {1, 4, "count", "scales of the image, each half the size of the one before"});
    v.number("min_length", min_length, {5.0, 1000.0, "px", "shorter segments are dropped"});
  }
};

/// Finds straight segments in an image.
class LineDetector {
 public:
  LineDetector(LineMethod method, const LineDetectorOptions& options, const Camera& camera);

  /// `grey` is CV_8UC1 of the camera's size. Longest first; depth is not filled in.
  [[nodiscard]] std::vector<LineSegment> detect(const cv::Mat& grey);

 private:
  LineMethod method_;
  LineDetectorOptions options_;
  Camera camera_;
};

}  // namespace ipl_slam
