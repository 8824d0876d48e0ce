#pragma once

#include <cstddef>

#include <opencv2/core.hpp>

#include "dense/semantic_cloud.hpp"
#include "evaluation/point_index.hpp"
#include "geometry/camera.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {

/// How good a cloud is. Distances in metres, shares 0 to 1.
struct CloudError {
  std::size_t points = 0;     ///< of the cloud
  double mean = 0.0;          ///< distance of a point to the true surface, of those within kFar of it
  double median = 0.0;        ///< the same
  double far = 0.0;           ///< share of the points with no true surface within kFar
  double completeness = 0.0;  ///< share of the true surface with a point of the cloud within kComplete
  double ghosts = 0.0;        ///< share of the points that lie on something that moved, and on nothing else

  static constexpr double kFar = 0.10;
  static constexpr double kComplete = 0.02;
  /// A point lies on a mover within this distance of where it was measured ...
  static constexpr double kOnMover = 0.02;
  /// ... unless something that stays was measured as near as this: people stand on floors and touch tables.
  static constexpr double kOnStatic = 0.03;
};

/// What there was to see, from depth images at known poses.
class CloudTruth {
 public:
  /// camera: distortion counts. max_depth: of surfaces that are to be in the cloud, m.
  CloudTruth(const Camera& camera, double max_depth);

  /// depth: CV_16UC1, raw units. moving: CV_8UC1, not 0 where something is that moves at some time; may be
  /// empty. Both as they lie in the (distorted) image. T_wc in the world of the truth.
  void add(const cv::Mat& depth, const cv::Mat& moving, const SE3& T_wc);
  /// T_truth_cloud takes the cloud into the truth's world.
  [[nodiscard]] CloudError compare(const SemanticCloud& cloud, const SE3& T_truth_cloud) const;

 private:
  Camera camera_;
  double max_depth_;
  std::vector<Eigen::Vector2f> rays_;  // x / z, y / z of the pixels that are taken, row by row
  PointIndex still_, moving_;
};

}  // namespace ipl_slam
