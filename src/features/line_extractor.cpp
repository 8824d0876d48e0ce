#include "features/line_extractor.hpp"

namespace ipl_slam {

LineExtractor::LineExtractor(LineMethod method, const LineOptions& options, const Camera& camera,
                             const DepthNoiseOptions& noise, std::uint64_t seed)
    : camera_(camera),
      noise_(noise),
      options_(options),
      seed_(seed),
      detector_(method, options.detector, camera) {}

LineFeatures LineExtractor::extract(const cv::Mat& grey, const cv::Mat& depth) {
  LineFeatures lines;
  lines.segments = detector_.detect(grey);
  lines.descriptors = describe_segments(grey, lines.segments, options_.descriptor);
  for (LineSegment& segment : lines.segments) {
    segment.depth = segment_depth(depth, segment, camera_, noise_, options_.depth, seed_);
  }
  return lines;
}

}  // namespace ipl_slam
