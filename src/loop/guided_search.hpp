#pragma once

#include <vector>

#include "common/options.hpp"
#include "features/line_matcher.hpp"
#include "features/matcher.hpp"
#include "loop/landmark_group.hpp"
#include "loop/place_view.hpp"
#include "tracking/line_visibility.hpp"
#include "tracking/pose_optimizer.hpp"
#include "tracking/visibility.hpp"

namespace ipl_slam {

struct GuidedSearchOptions {
  double line_sigma = 1.0;
  double line_depth_sigma = 0.01;
  MatchOptions match;
  LineProjectionOptions line_match;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("line_sigma", line_sigma,
             {0.05, 20.0, "px", "standard deviation of a segment's end points across it, at octave 0"});
    v.number("line_depth_sigma", line_depth_sigma,
             {0.0, 1.0, "1/m", "deviation of a segment's measured inverse depth beyond that of its fit"});
    v.section("match", match, "descriptor match of a landmark and a keypoint near its projection");
    v.section("line_match", line_match, "match of a projected line and a segment");
  }
};

/// A pose and the landmarks that agree with it.
struct Placement {
  SE3 T_cw;
  std::vector<PointId> points = {};  ///< per keypoint; invalid = none
  std::vector<LineId> lines = {};    ///< per segment, the same
  int inliers = 0;                   ///< of the points
  int line_inliers = 0;
  double deviation = 0.0;  ///< of the pose in its least certain direction, m or rad; infinite = open
};

/// Settles the pose of a view that is roughly known: every landmark of a group is looked for around its
/// projection, and the pose optimised with all the points and lines that were found.
class GuidedSearch {
 public:
  GuidedSearch(const Camera& camera, const ScalePyramid& pyramid, const DepthNoiseOptions& noise,
               const GuidedSearchOptions& options, const PoseOptimizerOptions& pose);

  /// `radius` of the search, pixels: of the landmark's pyramid level for points, across the line for lines.
  [[nodiscard]] Placement place(const Map& map, const PlaceView& view, const LandmarkGroup& group,
                                const SE3& T_cw, double radius) const;

 private:
  [[nodiscard]] std::vector<PointId> find_points(const Map& map, const PlaceView& view,
                                                 const LandmarkGroup& group, const SE3& T_cw,
                                                 double radius) const;
  [[nodiscard]] std::vector<LineId> find_lines(const Map& map, const PlaceView& view,
                                               const LandmarkGroup& group, const SE3& T_cw,
                                               double radius) const;
  [[nodiscard]] LineMatch line_match(const Line3& line_w, const LineSegment& segment, double weight) const;

  ScalePyramid pyramid_;
  GuidedSearchOptions options_;
  PoseOptimizer optimizer_;
  Visibility visibility_;
  LineVisibility line_visibility_;
};

}  // namespace ipl_slam
