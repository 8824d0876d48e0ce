#pragma once

#include <optional>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "common/options.hpp"
#include "geometry/camera.hpp"

namespace ipl_slam {

/// Settings of the search for known lines.
struct LineSearchOptions {
  double spacing = 4.0;
  int max_samples = 24;
  double min_found = 0.6;
  double min_contrast = 6.0;
  double contrast_ratio = 1.6;
  double max_tilt = 0.1;
  double max_spread = 0.5;
  double ambiguity = 0.4;
  double sigma = 0.7;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("spacing", spacing, {1.0, 100.0, "px", "distance of the samples along a line, at least"});
    v.number("max_samples", max_samples, {4, 64, "count", "samples along a line at most"});
    v.number(
        "min_found", min_found,
        {0.1, 1.0, "ratio", "share of the samples that must show the line's edge, on one straight line"});
    v.number("min_contrast", min_contrast,
             {1.0, 255.0, "grey value", "smaller steps are taken for noise, whatever is expected"});
    v.number("contrast_ratio", contrast_ratio,
             {1.0, 100.0, "ratio",
              "largest factor between the contrast expected and that of the line found, either way"});
    v.number("max_tilt", max_tilt,
             {0.0, 0.5, "rad", "largest angle between the line expected and the one found"});
    v.number("max_spread", max_spread,
             {0.0, 1.0, "px", "largest standard deviation of the samples from the line found"});
    v.number("ambiguity", ambiguity,
             {0.0, 1.0, "ratio",
              "where another line has more than this share of the best one's support, neither is taken"});
    v.number("sigma", sigma,
             {0.01, 10.0, "px",
              "standard deviation of a line found in what all its samples share: calibration, shutter, a "
              "slight bend"});
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

/// Finds a known line in an image without detecting anything: samples along the expected line, looks for
/// edges along the normal of each (steps of the right sign and about the right size), and fits the straight
/// line that most of them agree on. A few microseconds per line, so that every frame can have it.
///
/// Edges that run side by side are common (door frames, bezels, boards): where a second line explains the
/// samples nearly as well as the best, none is returned.
class LineSearch {
 public:
  LineSearch(const Camera& camera, const LineSearchOptions& options);

  /// Looks up to `radius` pixels (at most 40) to either side. `grey` is CV_8UC1, full size, distorted as it
  /// comes. Samples whose window leaves the image do not count; a line needs 4 that do not. The line found
  /// ends where the first and the last sample showed it.
  [[nodiscard]] std::optional<FoundLine> find(const cv::Mat& grey, const ExpectedLine& expected,
                                              double radius) const;

 private:
  Camera camera_;
  LineSearchOptions options_;
};

}  // namespace ipl_slam
