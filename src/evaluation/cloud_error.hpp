#pragma once

#include <cstddef>
#include <vector>

#include <opencv2/core.hpp>

#include "dataset/trajectory.hpp"
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
  static constexpr double kOnMover = 0.05;
  /// ... unless something that stays was measured as near as this: people stand on floors and touch tables.
  static constexpr double kOnStatic = 0.02;
};

/// What there was to see, from depth images at known poses.
class CloudTruth {
 public:
  /// camera: distortion counts. max_depth: of surfaces that are to be in the cloud, m. exact: the depth is
  /// without noise, so that surfaces are known between its pixels, too: distances are to their planes then,
  /// else to the nearest pixel's point.
  CloudTruth(const Camera& camera, double max_depth, bool exact = false);

  /// depth: CV_16UC1, raw units. moving: CV_8UC1, not 0 where something is that moves at some time; may be
  /// empty. Both as they lie in the (distorted) image. T_wc in the world of the truth.
  void add(const cv::Mat& depth, const cv::Mat& moving, const SE3& T_wc);
  /// Whether no surface was seen that stays: there is nothing to compare with.
  [[nodiscard]] bool empty() const { return still_.points().empty(); }
  /// T_truth_cloud takes the cloud into the truth's world.
  [[nodiscard]] CloudError compare(const SemanticCloud& cloud, const SE3& T_truth_cloud) const;

 private:
  [[nodiscard]] Eigen::Vector3f point_at(const cv::Mat& depth, int x, int y) const;
  [[nodiscard]] Eigen::Vector3f normal_at(const cv::Mat& depth, int x, int y) const;
  [[nodiscard]] double distance(const Eigen::Vector3f& point, const PointIndex::Neighbour& neighbour) const;

  Camera camera_;
  double max_depth_;
  bool exact_;
  std::vector<Eigen::Vector2f> rays_;  // x / z, y / z per pixel, row by row
  PointIndex still_, moving_;
  std::vector<Eigen::Vector3f> normals_;  // of still_, where exact; zero = not known
};

/// The rigid motion T_ge from the estimate's world into the ground truth's that fits all poses best,
/// rotations by rotations: of a short path positions alone leave the rotation to chance, which surfaces
/// metres away show. Poses are associated by time. Throws UserError where none can be.
[[nodiscard]] SE3 align_poses(const Trajectory& ground_truth, const Trajectory& estimate);

}  // namespace ipl_slam
