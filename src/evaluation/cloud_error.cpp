#include "evaluation/cloud_error.hpp"

#include <cmath>
#include <cstdint>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "evaluation/statistics.hpp"

namespace ipl_slam {
namespace {

constexpr int kStep = 2;            // pixels
constexpr double kSpacing = 0.005;  // m: closer points of the truth add nothing

// Between a mover and what is behind it depth is of neither.
constexpr int kUnsure = 3;  // pixels

}  // namespace

CloudTruth::CloudTruth(const Camera& camera, double max_depth)
    : camera_(camera), max_depth_(max_depth), still_(CloudError::kFar), moving_(CloudError::kFar) {
  for (int y = 0; y < camera.height; y += kStep) {
    for (int x = 0; x < camera.width; x += kStep) {
      rays_.push_back(camera.unproject(camera.undistort(Eigen::Vector2d(x, y)), 1.0).head<2>().cast<float>());
    }
  }
}

void CloudTruth::add(const cv::Mat& depth, const cv::Mat& moving, const SE3& T_wc) {
  cv::Mat near_mover, inside_mover;
  if (!moving.empty()) {
    const cv::Mat disc = cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * kUnsure + 1, 2 * kUnsure + 1});
    cv::dilate(moving, near_mover, disc);
    cv::erode(moving, inside_mover, disc);
  }
  const Eigen::Matrix3f R = T_wc.rotation_matrix().cast<float>();
  const Eigen::Vector3f t = T_wc.translation().cast<float>();
  auto ray = rays_.begin();
  for (int y = 0; y < camera_.height; y += kStep) {
    for (int x = 0; x < camera_.width; x += kStep, ++ray) {
      const auto z = static_cast<float>(depth.at<std::uint16_t>(y, x) / camera_.depth_scale);
      if (z <= 0.0F) continue;
      const Eigen::Vector3f point = R * Eigen::Vector3f(ray->x() * z, ray->y() * z, z) + t;
      if (!moving.empty() && inside_mover.at<std::uint8_t>(y, x) != 0) {
        moving_.add_apart(point, kSpacing);
      } else if ((moving.empty() || near_mover.at<std::uint8_t>(y, x) == 0) && z <= max_depth_) {
        still_.add_apart(point, kSpacing);
      }
    }
  }
}

CloudError CloudTruth::compare(const SemanticCloud& cloud, const SE3& T_truth_cloud) const {
  CloudError error;
  error.points = cloud.points.size();
  if (cloud.points.empty()) return error;
  const Eigen::Matrix3f R = T_truth_cloud.rotation_matrix().cast<float>();
  const Eigen::Vector3f t = T_truth_cloud.translation().cast<float>();
  PointIndex index(CloudError::kComplete);
  std::vector<double> distances;
  std::size_t ghosts = 0;
  for (const CloudPoint& p : cloud.points) {
    const Eigen::Vector3f point = R * p.position + t;
    index.add(point);
    const double to_still = still_.distance(point);
    if (std::isfinite(to_still)) distances.push_back(to_still);
    if (to_still > CloudError::kOnStatic && moving_.distance(point) <= CloudError::kOnMover) ++ghosts;
  }
  const auto all = static_cast<double>(cloud.points.size());
  if (!distances.empty()) {
    const Statistics s = error_statistics(distances);
    error.mean = s.mean;
    error.median = s.median;
  }
  error.far = 1.0 - static_cast<double>(distances.size()) / all;
  error.ghosts = static_cast<double>(ghosts) / all;
  std::size_t found = 0;
  still_.for_each([&](const Eigen::Vector3f& p) { found += std::isfinite(index.distance(p)) ? 1 : 0; });
  error.completeness =
      still_.size() > 0 ? static_cast<double>(found) / static_cast<double>(still_.size()) : 0.0;
  return error;
}

}  // namespace ipl_slam
