#pragma once

#include <span>
#include <vector>

#include <opencv2/core.hpp>

#include "common/options.hpp"
#include "features/line_features.hpp"

namespace ipl_slam {

/// Settings of the line band descriptor. The defaults are those of the original publication.
struct LineDescriptorOptions {
  /// Bands side by side along the segment. 256 bits take 32 different pairs of bands, so nine at least.
  int bands = 9;
  int band_width = 7;  ///< rows of a band, one pixel of the segment's octave each

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("bands", bands, {9, 21, "count", "bands parallel to the segment"});
    v.number("band_width", band_width, {1, 21, "px", "width of a band, pixels of the segment's octave"});
  }
};

/// Line band descriptors (LBD, Zhang and Koch, "An efficient and robust line segment matching approach based
/// on LBD descriptor and pairwise geometric consistency", JVCIR 2013), made binary: 256 bits, compared by
/// Hamming distance. One per segment, in their order.
///
/// The support region is `bands` x `band_width` rows parallel to the segment and as long as it. In each row
/// the image gradient, turned into the segment's own axes, gives four means: positive and negative part
/// across and along. A band's entries are mean and standard deviation of these four over its rows and those
/// of its two neighbours, with the paper's two Gaussian weights: one over the whole region, one over the
/// band. Bits: the eight entries of one band compared with those of another, for 32 pairs of bands, nearest
/// neighbours first and, of equal distance, those nearest to the segment. The paper's normalisation scales
/// all entries alike and cannot change a comparison; so it is not computed. Offset and gain of brightness do
/// not change the bits.
///
/// `grey` is CV_8UC1, full size, distorted as it comes; start_pixel and end_pixel say where the segments lie.
/// Octave k is read in the image halved k times. Only what lies inside the image counts: a row is the mean of
/// its samples inside, a row without any is left out, a band without any is zero. A segment of no length is
/// described as a single column of samples that runs to the right. Throws std::invalid_argument for another
/// type of image, an octave below 0, or options out of range.
[[nodiscard]] std::vector<Descriptor> describe_segments(const cv::Mat& grey,
                                                        std::span<const LineSegment> segments,
                                                        const LineDescriptorOptions& options);

}  // namespace ipl_slam
