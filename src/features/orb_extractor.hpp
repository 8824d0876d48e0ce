#pragma once

#include <functional>
#include <vector>

#include <opencv2/core.hpp>

#include "common/options.hpp"
#include "common/thread_pool.hpp"
#include "features/brief.hpp"
#include "features/fast_corners.hpp"
#include "features/features.hpp"
#include "features/keypoint_depth.hpp"
#include "geometry/camera.hpp"
#include "geometry/depth_noise.hpp"

namespace ipl_slam {

/// Settings of the point-feature extractor.
struct OrbOptions {
  int features = 1000;         ///< keypoints per frame at most
  int levels = 8;              ///< pyramid levels
  double scale_factor = 1.2;   ///< size ratio of neighbouring levels
  int fast_threshold = 20;     ///< corner threshold, grey levels
  int fast_min_threshold = 7;  ///< threshold for cells where the first one finds nothing
  int cell_size = 32;          ///< side of those cells, pixels of the level
  double spread = 1.0;         ///< share of the keypoints that is placed for even cover, the rest by strength
  bool refine = true;          ///< corners are located to a fraction of a pixel
  KeypointDepthOptions depth;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("features", features, {50, 20000, "count", "keypoints kept per frame at most"});
    v.number("levels", levels, {1, 16, "count", "pyramid levels, level 0 being the image itself"});
    v.number("scale_factor", scale_factor,
             {1.01, 2.0, "ratio", "size of a pyramid level over that of the next"});
    v.number("fast_threshold", fast_threshold,
             {1, 254, "grey levels", "FAST threshold: contrast a corner must have"});
    v.number("fast_min_threshold", fast_min_threshold,
             {1, 254, "grey levels", "FAST threshold of cells that hold no corner at fast_threshold"});
    v.number("cell_size", cell_size, {8, 512, "pixel", "side of the cells whose threshold adapts"});
    v.number("spread", spread,
             {0.0, 1.0, "ratio",
              "share of the keypoints placed for even cover of the image; the rest are the strongest corners "
              "left"});
    v.flag("refine", refine, "locate corners to a fraction of a pixel");
    v.section("depth", depth, "depth of a keypoint");
  }
};

/// Variance of a keypoint's position per pyramid level, in squared pixels of the full image: scale_factor^(2
/// level).
[[nodiscard]] std::vector<double> level_sigma2(const OrbOptions& options);

/// How many keypoints each level should give: a geometric series of ratio 1 / scale_factor that sums to
/// `factor` times options.features, as the images shrink by that ratio per side.
[[nodiscard]] std::vector<int> level_quotas(const OrbOptions& options, double factor = 1.0);

/// Oriented FAST corners with steered BRIEF descriptors over an image pyramid (Rublee et al., "ORB: an
/// efficient alternative to SIFT or SURF", ICCV 2011), spread evenly over the image by a quadtree, with the
/// depth of each. An instance keeps its buffers between frames: use one per thread. The result depends on the
/// images and options alone, not on the number of threads or the processor.
class OrbExtractor {
 public:
  /// `pool` may be null (one thread); it is not owned. Throws std::invalid_argument for options outside their
  /// ranges.
  OrbExtractor(const OrbOptions& options, const Camera& camera, const DepthNoiseOptions& noise,
               ThreadPool* pool = nullptr);

  /// Keypoints level by level, in reading order within a level. `image` is CV_8UC1 or CV_8UC3 (BGR), `depth`
  /// CV_16UC1 in raw units or empty for none; both of the camera's size. Throws std::invalid_argument
  /// otherwise. `factor` times options.features are looked for.
  [[nodiscard]] Features extract(const cv::Mat& image, const cv::Mat& depth, double factor = 1.0);

 private:
  struct Level {
    cv::Mat image, smooth, score;
    cv::Rect area;  // where corners may lie; empty if the level is too small
    double scale_x = 1.0, scale_y = 1.0;
    std::vector<Corner> corners;
    std::vector<int> chosen;
    Features features;
  };

  void check(const cv::Mat& image, const cv::Mat& depth) const;
  void build_pyramid(const cv::Mat& image);
  void detect(Level& level) const;
  void choose_corners(double factor);
  void describe(std::size_t index, const cv::Mat& depth);
  void for_each_level(const std::function<void(std::size_t)>& fn);

  OrbOptions options_;
  Camera camera_;
  DepthNoiseOptions noise_;
  ThreadPool* pool_;
  BriefDescriber describer_;
  std::vector<Level> levels_;
};

}  // namespace ipl_slam
