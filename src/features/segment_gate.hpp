#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "common/cpu.hpp"
#include "features/line_features.hpp"

namespace ipl_slam {

/// Which segments can be the one that is looked for.
struct SegmentGate {
  float radius = 10.0F;           ///< both end points lie no further than this from the expected line, pixels
  float min_cosine = 0.9F;        ///< of the difference of directions, > 0
  float min_overlap = 0.5F;       ///< along the expected line, of the shorter of the two
  float along = 0.0F;             ///< the segment may be shifted along the line by this to overlap, pixels
  float max_length_ratio = 4.0F;  ///< of the longer to the shorter
};

/// The segments of one image, laid out so that eight are checked at once. Undistorted pixels.
class SegmentTable {
 public:
  explicit SegmentTable(std::span<const LineSegment> segments);

  /// Appends the indices of the segments that pass for a line expected from start to end, in their order.
  /// None for an expected line of no length, or for segments of no length.
  void find(const Eigen::Vector2f& start, const Eigen::Vector2f& end, const SegmentGate& gate, Simd simd,
            std::vector<int>& found) const;

 private:
  std::size_t count_;
  // Filled up to whole groups of eight with segments of no direction, which never pass.
  std::vector<float> start_u_, start_v_, end_u_, end_v_, direction_u_, direction_v_, length_;
};

}  // namespace ipl_slam
