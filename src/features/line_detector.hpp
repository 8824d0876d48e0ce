#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "common/options.hpp"
#include "features/chain_splitter.hpp"
#include "features/edge_chains.hpp"
#include "features/edge_map.hpp"
#include "features/line_features.hpp"
#include "features/segment_joiner.hpp"
#include "features/undistortion_table.hpp"
#include "geometry/camera.hpp"

namespace ipl_slam {

/// How segments are found. The setting features.lines chooses (pipeline/config.hpp).
enum class LineMethod {
  kLsd,    ///< Grompone von Gioi et al., "LSD: a line segment detector", IPOL 2012, through OpenCV
  kEdges,  ///< our own: edges are drawn, freed from the lens distortion and cut into straight pieces
};

/// Settings of the method `edges`.
struct EdgeOptions {
  double min_gradient = 3.0;     ///< grey values per pixel
  double anchor_gradient = 5.0;  ///< grey values per pixel
  ChainSplitterOptions pieces;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number(
        "min_gradient", min_gradient,
        {0.1, 100.0, "grey/px", "an edge ends where the gradient of the smoothed image falls below this"});
    v.number("anchor_gradient", anchor_gradient,
             {0.1, 100.0, "grey/px", "an edge needs a gradient of this size somewhere"});
    v.section("pieces", pieces, "straight pieces of an edge");
  }
};

/// Settings of the line detector.
struct LineDetectorOptions {
  int octaves = 2;            ///< scales, each half the size of the one before
  double min_piece = 12.0;    ///< pixels of the octave
  double min_length = 25.0;   ///< pixels
  double min_contrast = 8.0;  ///< grey values
  int max_segments = 200;     ///< the longest are kept
  EdgeOptions edges;
  SegmentJoinerOptions joiner;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("octaves", octaves,
             {1, 4, "count", "scales of the image, each half the size of the one before"});
    v.number("min_piece", min_piece,
             {2.0, 1000.0, "px", "shorter pieces are not joined to segments; pixels of the octave"});
    v.number("min_length", min_length, {5.0, 1000.0, "px", "shorter segments are dropped"});
    v.number("min_contrast", min_contrast,
             {0.0, 255.0, "grey", "segments with a weaker mean step across them are dropped"});
    v.number("max_segments", max_segments, {1, 10000, "count", "the longest segments are kept"});
    v.section("edges", edges, "the method edges");
    v.section("joiner", joiner, "pieces of one edge that become one segment");
  }
};

/// Finds straight segments in an image: pieces on every octave, joined in undistorted coordinates, measured
/// again in the image.
class LineDetector {
 public:
  LineDetector(LineMethod method, const LineDetectorOptions& options, const Camera& camera);

  /// `grey` is CV_8UC1 of the camera's size (std::invalid_argument). Longest first; depth is not filled in.
  /// End points of joined segments can stick out of the image by a fraction of a pixel.
  [[nodiscard]] std::vector<LineSegment> detect(const cv::Mat& grey);

 private:
  void find_lsd(const cv::Mat& image, int octave, std::vector<LineSegment>& pieces) const;
  void find_edges(const cv::Mat& image, int octave, std::vector<LineSegment>& pieces);
  [[nodiscard]] float contrast(const cv::Mat& image, const LineSegment& segment) const;

  LineMethod method_;
  LineDetectorOptions options_;
  Camera camera_;
  UndistortionTable undistort_;
  // Memory kept from call to call.
  std::vector<EdgeMap> maps_;  // by octave
  EdgeChainFinder chain_finder_;
  EdgeChains chains_;
};

}  // namespace ipl_slam
