#pragma once

#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "common/cpu.hpp"
#include "common/options.hpp"
#include "features/line_features.hpp"

namespace ipl_slam {

/// Settings of line matching between two keyframes of unknown pose. The map does not use it: it knows its
/// poses. The defaults are from a sweep over three recordings and three rendered sequences, five and ten
/// frames apart, for precision first, then recall.
struct LineMatchOptions {
  int max_distance = 80;            ///< differing bits of 256 at most
  double ratio = 0.8;               ///< best distance over that of the best rival; 1 = no test
  double max_rotation = 0.6;        ///< of directions, before the common motion is known, rad
  double max_displacement = 150.0;  ///< likewise of positions, pixels
  double max_turn = 0.15;           ///< of directions, against the common motion, rad
  double max_offset = 25.0;         ///< likewise of positions, pixels
  double min_overlap = 0.5;         ///< along the line, of the shorter segment
  double max_length_ratio = 4.0;    ///< of the longer segment to the shorter

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("max_distance", max_distance, {0, 256, "bits", "descriptor distance a match may have"});
    v.number("ratio", ratio,
             {0.1, 1.0, "ratio", "best distance must be below this times the second best; 1 = no test"});
    v.number("max_rotation", max_rotation,
             {0.01, 1.5, "rad", "change of direction before the common motion of the lines is known"});
    v.number("max_displacement", max_displacement,
             {1.0, 10000.0, "px", "displacement before the common motion of the lines is known"});
    v.number("max_turn", max_turn,
             {0.01, 1.5, "rad", "direction may deviate from the common motion by this"});
    v.number("max_offset", max_offset,
             {1.0, 10000.0, "px", "position may deviate from the common motion by this"});
    v.number("min_overlap", min_overlap,
             {0.0, 1.0, "ratio", "overlap along the line, of the shorter of the two segments"});
    v.number("max_length_ratio", max_length_ratio,
             {1.0, 100.0, "ratio", "the longer segment over the shorter"});
  }
};

/// Matches the lines of two keyframes of unknown pose: pairs (index in a, index in b), ascending in a,
/// one-to-one. First every segment of `b` that is not too far, too long, too short or too much turned is a
/// candidate; those that are each other's closest by descriptor and pass the ratio test in both directions
/// tell the motion that most lines share (features/line_motion.hpp). Then the same with candidates near to
/// where that motion carries the segment; these are the matches. The ratio test does not count pieces of the
/// same straight line as rivals.
[[nodiscard]] std::vector<std::pair<int, int>> match_lines(const LineFeatures& a, const LineFeatures& b,
                                                           const LineMatchOptions& options,
                                                           Simd simd = best_simd());

/// Settings of line matching with a predicted pose.
struct LineProjectionOptions {
  int max_distance = 80;           ///< differing bits of 256 at most
  double ratio = 0.8;              ///< best distance over that of the best rival; 1 = no test
  double max_angle = 0.15;         ///< between expected and found direction, rad
  double min_overlap = 0.5;        ///< along the line, of the shorter of the two
  double max_length_ratio = 10.0;  ///< of the longer of the two to the shorter

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("max_distance", max_distance, {0, 256, "bits", "descriptor distance a match may have"});
    v.number("ratio", ratio,
             {0.1, 1.0, "ratio", "best distance must be below this times the second best; 1 = no test"});
    v.number("max_angle", max_angle,
             {0.01, 1.5, "rad", "direction may differ from the predicted one by this"});
    v.number("min_overlap", min_overlap,
             {0.0, 1.0, "ratio", "overlap along the line, of the shorter of the two segments"});
    v.number("max_length_ratio", max_length_ratio,
             {1.0, 1000.0, "ratio", "the longer segment over the shorter"});
  }
};

/// A line landmark as it is expected in the image.
struct ProjectedSegment {
  Eigen::Vector2f start = Eigen::Vector2f::Zero();  ///< undistorted pixel
  Eigen::Vector2f end = Eigen::Vector2f::Zero();    ///< brighter side on the right of start -> end
  const Descriptor* descriptor = nullptr;           ///< not null
  float radius = 0.0F;  ///< the end points of a match lie no further from the projected line, pixels
};

/// Finds each projected landmark among the segments: the index per landmark, -1 where there is none. Of the
/// segments whose direction, distance and overlap fit, the closest by descriptor wins if it is within
/// max_distance and passes the ratio test; pieces of one straight line are no rivals of each other. Matches
/// are one-to-one: the closest of all pairs is taken first, the first among equals.
[[nodiscard]] std::vector<int> match_projected_lines(const LineFeatures& lines,
                                                     std::span<const ProjectedSegment> projected,
                                                     const LineProjectionOptions& options,
                                                     Simd simd = best_simd());

}  // namespace ipl_slam
