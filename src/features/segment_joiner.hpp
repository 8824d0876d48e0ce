#pragma once

#include <vector>

#include "common/options.hpp"
#include "features/line_features.hpp"

namespace ipl_slam {

/// Settings of the joiner. Offsets are meant at full size; on coarser octaves they grow with the pixel.
struct SegmentJoinerOptions {
  double max_angle = 3.0;      ///< degrees
  double max_offset = 1.0;     ///< pixels
  double max_gap_ratio = 0.3;  ///< of the length of the shorter piece
  double max_gap = 20.0;       ///< pixels

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("max_angle", max_angle, {0.0, 30.0, "deg", "between pieces of one edge"});
    v.number("max_offset", max_offset,
             {0.0, 10.0, "px", "of a piece's end points from the line fitted to all pieces"});
    v.number("max_gap_ratio", max_gap_ratio,
             {0.0, 1.0, "ratio", "gap between two pieces, by the length of the shorter one"});
    v.number("max_gap", max_gap, {0.0, 200.0, "px", "gap between two pieces"});
  }
};

/// Joins pieces of one straight edge: same direction (thus same bright side), on one line, overlapping or a
/// small gap apart. Works on the undistorted end points `start` and `end`, where straight edges of the world
/// are straight; `start_pixel` and `end_pixel` of joined segments are not brought up to date. A segment that
/// was found again on a coarser octave is a piece of the same edge too; its position weighs less. The result
/// runs longest first and does not depend on the order of the input, except among equally long segments.
[[nodiscard]] std::vector<LineSegment> join_segments(std::vector<LineSegment> segments,
                                                     const SegmentJoinerOptions& options);

}  // namespace ipl_slam
