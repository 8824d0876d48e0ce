#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "common/options.hpp"
#include "loop/guided_search.hpp"
#include "loop/place_view.hpp"
#include "map/map.hpp"
#include "tracking/pose_optimizer.hpp"
#include "tracking/visibility.hpp"

namespace ipl_slam {

struct PlaceVerifierOptions {
  int neighbours = 10;
  int min_matches = 8;
  double ransac_threshold = 4.0;
  int ransac_iterations = 1000;
  double wide_radius = 24.0;
  double narrow_radius = 4.0;
  int min_inliers = 80;
  double min_found_share = 0.15;
  int min_observations = 2;
  double hiding_distance = 20.0;
  double hiding_gate = 0.1;
  int min_cells = 4;
  double min_cell_share = 0.55;
  double max_deviation = 0.05;
  int min_confirming_inliers = 25;
  MatchOptions match{.ratio = 0.95};
  GuidedSearchOptions search = {};

  template <class Visitor>
  void visit(Visitor& v) {
    v.number(
        "neighbours", neighbours,
        {0, 100, "count", "best covisible keyframes of the candidate whose landmarks are looked for too"});
    v.number("min_matches", min_matches,
             {3, 1000, "count", "descriptor matches that must agree on a first pose"});
    v.number("ransac_threshold", ransac_threshold,
             {0.1, 50.0, "px", "reprojection error such a match may have, at its pyramid level"});
    v.number("ransac_iterations", ransac_iterations, {10, 10000, "count", "samples drawn at most"});
    v.number("wide_radius", wide_radius,
             {1.0, 100.0, "px", "first search around a landmark, at its pyramid level"});
    v.number("narrow_radius", narrow_radius, {1.0, 100.0, "px", "the same of the last search"});
    v.number("min_inliers", min_inliers, {6, 10000, "count", "points that must agree on one pose"});
    v.number("min_found_share", min_found_share,
             {0.0, 1.0, "share",
              "points found over those the pose lets expect; each counts as often as it was found while it "
              "was mapped"});
    v.number("min_observations", min_observations,
             {1, 100, "count", "keyframes that see a point which is to be expected"});
    v.number(
        "hiding_distance", hiding_distance,
        {0.0, 200.0, "px",
         "a point is hidden when the keypoint nearest to it, within this, is much nearer to the camera or "
         "removed"});
    v.number("hiding_gate", hiding_gate,
             {0.0, 100.0, "1/m", "inverse depth by which that keypoint must be nearer than the point"});
    v.number("min_cells", min_cells,
             {1, 12, "count", "cells of the image, 4 across and 3 down, that must hold points that agree"});
    v.number("min_cell_share", min_cell_share,
             {0.0, 1.0, "share",
              "of the cells that hold keypoints to go by, those that must hold points that agree"});
    v.number(
        "max_deviation", max_deviation,
        {0.001, 10.0, "m", "the pose must be known to this in its least certain direction (of a turn, rad)"});
    v.number("min_confirming_inliers", min_confirming_inliers,
             {6, 10000, "count", "points that must be found by a further keyframe that confirms a match"});
    v.section("match", match, "descriptor match of the view and the candidate");
    v.section("search", search, "search for the landmarks of the place from a pose that is nearly right");
  }
};

/// Where a view was found.
struct PlaceMatch {
  KeyframeId keyframe;          ///< the candidate it was compared with
  SE3 T_cw;                     ///< pose of the view in the world of that keyframe's part
  std::vector<PointId> points;  ///< per keypoint: the landmark seen there; invalid = none
  std::vector<LineId> lines;    ///< per segment, the same
  int inliers = 0;              ///< points that agree with the pose
  int line_inliers = 0;
  double found_share = 0.0;  ///< found points over those that the pose lets expect, at most 1
  int cells = 0;             ///< of the image that hold inliers
  double deviation = 0.0;    ///< of the pose in its least certain direction, m or rad
};

/// Decides whether a view shows the place of a keyframe, and from where: descriptor matches with the
/// landmarks that keyframe sees, a first pose from them by RANSAC (absolute_pose.hpp), then a guided search
/// for all points and lines around and the pose they agree on. Many inliers are no proof: a poster that hangs
/// in two rooms gives them in both. So enough of what the pose lets expect must be there too, all over the
/// image. Where all things come again, as doors and lamps along a corridor do, no single comparison can tell:
/// the true place gives more inliers than its doubles, so candidates are to be compared with each other.
class PlaceVerifier {
 public:
  /// Its samples depend on the view's frame index, the keyframe's id and `seed`.
  PlaceVerifier(const Camera& camera, const ScalePyramid& pyramid, const DepthNoiseOptions& noise,
                const PlaceVerifierOptions& options, const PoseOptimizerOptions& pose,
                std::uint64_t seed = 0);

  /// Nothing where too little agrees, or too much of what the pose lets expect is not there.
  [[nodiscard]] std::optional<PlaceMatch> verify(const Map& map, const PlaceView& view,
                                                 KeyframeId candidate) const;
  /// Whether a further view, placed at T_cw in the world of the candidate's part by what was found for
  /// another one, sees the candidate's place as well: search and decision as in verify, without a first pose.
  [[nodiscard]] bool confirms(const Map& map, const PlaceView& further, const SE3& T_cw,
                              KeyframeId candidate) const;

 private:
  [[nodiscard]] std::optional<SE3> first_pose(const Map& map, const PlaceView& view,
                                              KeyframeId candidate) const;
  [[nodiscard]] double found_share(const Map& map, const PlaceView& view, const LandmarkGroup& group,
                                   const Placement& placement) const;
  [[nodiscard]] bool hidden(const PlaceView& view, const ProjectedPoint& point) const;
  /// Cells of the image that hold points which agree, and those that hold keypoints to go by.
  [[nodiscard]] std::pair<int, int> count_cells(const PlaceView& view, const Placement& placement) const;

  Camera camera_;
  ScalePyramid pyramid_;
  PlaceVerifierOptions options_;
  PoseOptimizer optimizer_;
  Visibility visibility_;
  GuidedSearch search_;
  std::uint64_t seed_;
};

}  // namespace ipl_slam
