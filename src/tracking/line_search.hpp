#pragma once

#include <optional>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "common/options.hpp"
#include "geometry/camera.hpp"

namespace ipl_slam {

/// Settings of the search for known lines.
struct LineSearchOptions {
  double spacing = 6.0;  ///< pixels between samples
  int max_samples = 16;
  double min_found = 0.5;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("spacing", spacing, {1.0, 100.0, "px", "distance of the samples along a line"});
    v.number("max_samples", max_samples, {4, 200, "count", "samples along a line at most"});
    v.number(
        "min_found", min_found,
        {0.1, 1.0, "ratio", "share of the samples that must show the line's edge, on one straight line"});
  }
};

/// Where a line is expected in the frame: undistorted pixels, brighter side on the right of start -> end
/// (features/line_features.hpp).
struct ExpectedLine {
  Eigen::Vector2d start = Eigen::Vector2d::Zero();
  Eigen::Vector2d end = Eigen::Vector2d::Zero();
  float contrast = 0.0F;  ///< mean step of the grey value when it was seen last
};

/// Where it was found.
struct FoundLine {
  Eigen::Vector2d start = Eigen::Vector2d::Zero();  ///< undistorted, same direction
  Eigen::Vector2d end = Eigen::Vector2d::Zero();
  float contrast = 0.0F;
  double sigma2 = 1.0;  ///< variance of an end point across the line, pixel^2
};

/// Finds a known line in an image without detecting anything: samples along the expected line, looks for the
/// edge along the normal of each, and fits a straight line to what was found. A few microseconds per line, so
/// that every frame can have it.
class LineSearch {
 public:
  LineSearch(const Camera& camera, const LineSearchOptions& options);

  /// Looks up to `radius` pixels to either side. `grey` is CV_8UC1, full size, distorted as it comes.
  [[nodiscard]] std::optional<FoundLine> find(const cv::Mat& grey, const ExpectedLine& expected,
                                              double radius) const;

 private:
  Camera camera_;
  LineSearchOptions options_;
};

}  // namespace ipl_slam
