#pragma once

#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "common/options.hpp"
#include "features/line_matcher.hpp"
#include "geometry/camera.hpp"
#include "geometry/depth_noise.hpp"
#include "map/map.hpp"
#include "tracking/line_visibility.hpp"
#include "tracking/tracked_frame.hpp"

namespace ipl_slam {

struct LineMappingOptions {
  double radius = 5.0;
  double inverse_depth_gate = 0.1;
  double fusion_radius = 2.0;
  LineProjectionOptions match;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("radius", radius,
             {0.5, 50.0, "px", "a segment's end points may lie this far across from a projected line"});
    v.number("inverse_depth_gate", inverse_depth_gate,
             {0.0, 100.0, "1/m",
              "inverse depth measured at a segment's ends may differ from the line's by this; 0 = no check"});
    v.number(
        "fusion_radius", fusion_radius,
        {0.1, 50.0, "px", "two lines are one when neither leaves the other by more than this in the image"});
    v.section("match", match, "match of a projected line and a segment");
  }
};

/// Line landmarks of a new keyframe: which of its segments show known lines, which are new, and which lines
/// of the map are the same.
class LineMapping {
 public:
  LineMapping(const Camera& camera, const DepthNoiseOptions& noise, const LineMappingOptions& options)
      : camera_(camera), noise_(noise), options_(options), visibility_(camera) {}

  /// Finds the lines that the keyframe's neighbours see, and those the tracker saw in it, among its segments.
  void associate(Map& map, KeyframeId id, const std::vector<SeenLine>& tracked) const;
  /// Makes a line of every segment of known depth that has none. Returns the new ones.
  std::vector<LineId> create(Map& map, KeyframeId id) const;
  /// Joins lines of the keyframe with others around it that are the same edge.
  void fuse(Map& map, KeyframeId id) const;
  /// Looks for given lines in a keyframe: a segment that shows one sees it from now on, and a line of the
  /// keyframe that is the same edge becomes one with it.
  void fuse_into(Map& map, KeyframeId target, std::span<const LineId> candidates) const;
  /// Makes two lines one that runs along `kept`, as far as either was seen.
  void join(Map& map, LineId kept, LineId gone) const;

 private:
  void observe(Map& map, KeyframeId id, const std::set<LineId>& candidates) const;
  void join_same_edges(Map& map, KeyframeId id, const std::set<LineId>& others) const;
  [[nodiscard]] bool agrees(const Line3& line_c, const LineSegment& segment) const;
  [[nodiscard]] bool same_edge(const Map& map, LineId a, LineId b) const;
  [[nodiscard]] std::optional<double> image_distance(const SE3& T_cw, const Line& line,
                                                     const Line& other) const;

  Camera camera_;
  DepthNoiseOptions noise_;
  LineMappingOptions options_;
  LineVisibility visibility_;
};

/// Ends of a line as its observations show it: where the rays of the observed end points meet it, the
/// outermost ones (world, m, in the line's direction). Nothing where fewer than two rays do, being (nearly)
/// parallel to it, or where the line lies behind the cameras or beyond noise.max_depth.
[[nodiscard]] std::optional<std::pair<Eigen::Vector3d, Eigen::Vector3d>> observed_extent(
    const Map& map, const Camera& camera, const DepthNoiseOptions& noise, const Line3& line_w,
    const std::vector<Observation>& observations);

}  // namespace ipl_slam
