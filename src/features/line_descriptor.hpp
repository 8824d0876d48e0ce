#pragma once

#include <span>
#include <vector>

#include <opencv2/core.hpp>

#include "common/options.hpp"
#include "features/line_features.hpp"

namespace ipl_slam {

/// Settings of the line band descriptor.
struct LineDescriptorOptions {
  int bands = 9;       ///< bands side by side along the segment
  int band_width = 7;  ///< pixels

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("bands", bands, {3, 21, "count", "bands parallel to the segment"});
    v.number("band_width", band_width, {1, 21, "px", "width of a band"});
  }
};

/// Line band descriptors (LBD, Zhang and Koch, "An efficient and robust line segment matching approach based
/// on LBD descriptor and pairwise geometric consistency", JVCIR 2013), made binary: 256 bits, compared by
/// Hamming distance. One per segment, in their order. `grey` is CV_8UC1, full size.
[[nodiscard]] std::vector<Descriptor> describe_segments(const cv::Mat& grey,
                                                        std::span<const LineSegment> segments,
                                                        const LineDescriptorOptions& options);

}  // namespace ipl_slam
