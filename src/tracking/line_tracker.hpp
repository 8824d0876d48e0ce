#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "common/options.hpp"
#include "features/line_features.hpp"
#include "features/segment_depth.hpp"
#include "geometry/camera.hpp"
#include "geometry/depth_noise.hpp"
#include "geometry/se3.hpp"
#include "map/local_map.hpp"
#include "tracking/line_search.hpp"
#include "tracking/line_visibility.hpp"
#include "tracking/pose_optimizer.hpp"

namespace ipl_slam {

struct LineTrackerOptions {
  int max_lines = 60;
  double min_length = 25.0;
  double radius = 5.0;
  double wide_radius = 15.0;
  double depth_sigma = 0.002;
  LineSearchOptions search;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("max_lines", max_lines,
             {1, 1000, "count", "lines of the local map looked for in a frame, the longest"});
    v.number("min_length", min_length, {5.0, 1000.0, "px", "a line must show at least this long"});
    v.number("radius", radius, {1.0, 50.0, "px", "search to either side of a line"});
    v.number("wide_radius", wide_radius,
             {1.0, 100.0, "px", "the same while the pose is a mere prediction, for want of points"});
    v.number("depth_sigma", depth_sigma,
             {0.0, 1.0, "1/m",
              "deviation of a line's measured inverse depth beyond that of its fit; measured where points "
              "are rare"});
    v.section("search", search, "search for the edge of a known line");
  }
};

/// A line of the local map that was found in the frame.
struct LineSight {
  int line = -1;  ///< index into LocalMap::lines
  FoundLine at;
  SegmentDepth depth = {};  ///< at its end points; not known until measured
};

/// What a look at the frame gave.
struct LineSights {
  std::vector<int> visible;      ///< all that were looked for, indices into LocalMap::lines
  std::vector<LineSight> found;  ///< in the same order
};

/// Finds the lines of the local map in ordinary frames, whose own lines are never extracted.
class LineTracker {
 public:
  LineTracker(const Camera& camera, const LineTrackerOptions& options, const DepthNoiseOptions& noise = {},
              const SegmentDepthOptions& depth_options = {}, std::uint64_t seed = 0);

  /// Looks for the lines that T_cw lets expect, `radius` pixels to either side. `grey` is CV_8UC1 as it
  /// comes; nothing is found where it is empty.
  [[nodiscard]] LineSights look(const cv::Mat& grey, const SE3& T_cw, const LocalMap& map,
                                double radius) const;
  /// Measures the depth along the lines found. `depth` is CV_16UC1, raw units, registered to the grey image;
  /// nothing is known where it is empty.
  void measure_depth(const cv::Mat& depth, LineSights& sights) const;
  /// The same lines as the pose optimiser wants them.
  [[nodiscard]] std::vector<LineMatch> matches(const LineSights& sights, const LocalMap& map) const;

 private:
  Camera camera_;
  LineTrackerOptions options_;
  DepthNoiseOptions noise_;
  SegmentDepthOptions depth_options_;
  std::uint64_t seed_;
  LineVisibility visibility_;
  LineSearch search_;
};

}  // namespace ipl_slam
