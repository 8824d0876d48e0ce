#pragma once

#include <cstdint>

#include <opencv2/core.hpp>

#include "common/options.hpp"
#include "features/line_features.hpp"
#include "geometry/camera.hpp"
#include "geometry/depth_noise.hpp"

namespace ipl_slam {

/// Settings of the depth fit along a segment. Those in 1/m follow from a structured-light camera of the first
/// Kinect's kind: disparity = 43.5 pixel metres / z, in steps of 1/8 pixel, with a deviation of 0.0014 1/m
/// (Khoshelham and Elberink, "Accuracy and resolution of Kinect depth data", Sensors 2012).
struct SegmentDepthOptions {
  double edge_gap = 0.02;     ///< what lies farther behind the nearest surface across is background, 1/m
  double tolerance = 0.008;   ///< a sample this near to the line agrees with it, 1/m
  double resolution = 0.001;  ///< error of each end that no averaging takes away, 1/m
  double edge_sigma = 0.03;   ///< the same of a segment on a depth edge, 1/m
  double correlation_length = 4.0;  ///< depth samples nearer than this count as one, pixels
  double min_support = 0.4;         ///< share of the samples that must agree
  double min_span = 0.6;            ///< share of the segment between the outermost samples that agree

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("edge_gap", edge_gap,
             {1e-4, 10.0, "1/m",
              "depth beside a segment this much behind the nearest, in inverse depth, is background"});
    v.number("tolerance", tolerance,
             {1e-5, 1.0, "1/m", "inverse depth this near to the fitted line agrees with it"});
    v.number("resolution", resolution,
             {0.0, 1.0, "1/m", "standard deviation of an end's inverse depth that no averaging takes away"});
    v.number("edge_sigma", edge_sigma,
             {0.0, 1.0, "1/m",
              "the same where background shows beside most of the segment: outlines in the depth image are "
              "off by pixels"});
    v.number("correlation_length", correlation_length,
             {0.0, 100.0, "pixel", "errors of depth pixels nearer than this are taken for one"});
    v.number("min_support", min_support,
             {0.0, 1.0, "ratio", "share of the samples along a segment that must agree with its line"});
    v.number("min_span", min_span,
             {0.0, 1.0, "ratio",
              "share of a segment's length that the samples which agree must span: what lies beyond them is "
              "extrapolated"});
  }
};

/// Depth along a segment. 1/z of a straight edge is an affine function of the position along its undistorted
/// image: it is fitted to samples of the depth image, one every 1.5 pixels or fewer, by RANSAC and then by
/// least squares over those that agree. Where the segment lies on a depth edge, a sample is taken from the
/// nearer of the two surfaces within 3 pixels across, for an outline belongs to what is in front.
///
/// The covariance is that of least squares with the variance of the residuals, as if only one sample in
/// every correlation_length had been drawn (neighbouring pixels of a depth camera share their error), plus
/// resolution^2 at each end, or edge_sigma^2 where most samples lie on a depth edge.
///
/// Not known where fewer than six samples or a share below min_support agree, where those span less than
/// min_span, or where the line reaches beyond noise.max_depth. `depth` is CV_16UC1, raw units, registered to
/// the colour image, or empty. The samples of RANSAC depend on `seed`: the same input gives the same
/// result.
[[nodiscard]] SegmentDepth segment_depth(const cv::Mat& depth, const LineSegment& segment,
                                         const Camera& camera, const DepthNoiseOptions& noise,
                                         const SegmentDepthOptions& options, std::uint64_t seed = 0);

}  // namespace ipl_slam
