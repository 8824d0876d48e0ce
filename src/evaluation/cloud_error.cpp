#include "evaluation/cloud_error.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/SVD>
#include <opencv2/imgproc.hpp>

#include <ipl_slam/error.hpp>

#include "dataset/association.hpp"
#include "evaluation/statistics.hpp"

namespace ipl_slam {
namespace {

constexpr int kStep = 2;            // pixels
constexpr double kSpacing = 0.005;  // m: closer points of the truth add nothing

// Between a mover and what is behind it depth is of neither.
constexpr int kUnsure = 3;  // pixels

// Neighbouring pixels of one surface differ by less than this share of their depth.
constexpr float kSameSurface = 0.03F;

// A point farther aside of its neighbour than the truth's points are from each other lies beyond the
// surface's edge, where its plane says nothing.
constexpr double kAside = 0.02;  // m

}  // namespace

CloudTruth::CloudTruth(const Camera& camera, double max_depth, bool exact)
    : camera_(camera),
      max_depth_(max_depth),
      exact_(exact),
      still_(CloudError::kFar),
      moving_(CloudError::kOnMover) {
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      rays_.push_back(camera.unproject(camera.undistort(Eigen::Vector2d(x, y)), 1.0).head<2>().cast<float>());
    }
  }
}

// In the camera's frame; z = 0 without depth.
Eigen::Vector3f CloudTruth::point_at(const cv::Mat& depth, int x, int y) const {
  const auto z = static_cast<float>(depth.at<std::uint16_t>(y, x) / camera_.depth_scale);
  const Eigen::Vector2f& ray = rays_[static_cast<std::size_t>(y * camera_.width + x)];
  return {ray.x() * z, ray.y() * z, z};
}

// In the camera's frame; zero beside an edge.
Eigen::Vector3f CloudTruth::normal_at(const cv::Mat& depth, int x, int y) const {
  if (x < 1 || y < 1 || x + 1 >= camera_.width || y + 1 >= camera_.height) return Eigen::Vector3f::Zero();
  const float z = point_at(depth, x, y).z();
  const Eigen::Vector3f left = point_at(depth, x - 1, y), right = point_at(depth, x + 1, y),
                        up = point_at(depth, x, y - 1), down = point_at(depth, x, y + 1);
  for (const Eigen::Vector3f* p : {&left, &right, &up, &down}) {
    if (std::abs(p->z() - z) > kSameSurface * z) return Eigen::Vector3f::Zero();
  }
  return (right - left).cross(down - up).normalized();
}

void CloudTruth::add(const cv::Mat& depth, const cv::Mat& moving, const SE3& T_wc) {
  cv::Mat near_mover = cv::Mat::zeros(depth.size(), CV_8UC1), inside_mover = near_mover;
  if (!moving.empty()) {
    const cv::Mat disc = cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * kUnsure + 1, 2 * kUnsure + 1});
    cv::dilate(moving, near_mover, disc);
    cv::erode(moving, inside_mover, disc);
  }
  const Eigen::Matrix3f R = T_wc.rotation_matrix().cast<float>();
  const Eigen::Vector3f t = T_wc.translation().cast<float>();
  for (int y = 0; y < camera_.height; y += kStep) {
    for (int x = 0; x < camera_.width; x += kStep) {
      const Eigen::Vector3f point_c = point_at(depth, x, y);
      if (point_c.z() <= 0.0F) continue;
      const Eigen::Vector3f point = R * point_c + t;
      if (inside_mover.at<std::uint8_t>(y, x) != 0) {
        if (!moving_.any_within(point, kSpacing)) moving_.add(point);
      } else if (near_mover.at<std::uint8_t>(y, x) == 0 && point_c.z() <= max_depth_ &&
                 !still_.any_within(point, kSpacing)) {
        still_.add(point);
        if (exact_) normals_.push_back(R * normal_at(depth, x, y));
      }
    }
  }
}

double CloudTruth::distance(const Eigen::Vector3f& point, const PointIndex::Neighbour& neighbour) const {
  if (!exact_) return neighbour.distance;
  const Eigen::Vector3f offset = point - still_.points()[neighbour.number];
  const Eigen::Vector3f& normal = normals_[neighbour.number];
  const auto along = static_cast<double>(std::abs(normal.dot(offset)));
  const double aside = std::sqrt(std::max(0.0, static_cast<double>(offset.squaredNorm()) - along * along));
  return normal.isZero() || aside > kAside ? neighbour.distance : along;
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
    const std::optional<PointIndex::Neighbour> still = still_.nearest(point);
    if (still) distances.push_back(distance(point, *still));
    const bool on_static = still && still->distance <= CloudError::kOnStatic;
    if (!on_static && moving_.nearest(point)) ++ghosts;
  }
  const auto all = static_cast<double>(cloud.points.size());
  const Statistics s = error_statistics(distances);
  error.mean = s.mean;
  error.median = s.median;
  error.far = 1.0 - static_cast<double>(distances.size()) / all;
  error.ghosts = static_cast<double>(ghosts) / all;
  std::size_t found = 0;
  for (const Eigen::Vector3f& p : still_.points()) found += index.nearest(p) ? 1 : 0;
  if (!still_.points().empty()) {
    error.completeness = static_cast<double>(found) / static_cast<double>(still_.points().size());
  }
  return error;
}

SE3 align_poses(const Trajectory& ground_truth, const Trajectory& estimate) {
  const auto stamps = [](const Trajectory& trajectory) {
    std::vector<double> list;
    for (const StampedPose& p : trajectory) list.push_back(p.timestamp);
    return list;
  };
  const auto pairs = associate(stamps(ground_truth), stamps(estimate));
  if (pairs.empty()) throw UserError("no pose of the trajectory has ground truth at its time");
  Eigen::Matrix3d rotations = Eigen::Matrix3d::Zero();
  for (const auto& [truth, own] : pairs) {
    rotations +=
        ground_truth[truth].T_wc.rotation_matrix() * estimate[own].T_wc.rotation_matrix().transpose();
  }
  // The rotation nearest to their sum.
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(rotations, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d sign = Eigen::Vector3d::Ones();
  sign.z() = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  const Eigen::Matrix3d R = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  Eigen::Vector3d t = Eigen::Vector3d::Zero();
  for (const auto& [truth, own] : pairs) {
    t += ground_truth[truth].T_wc.translation() - R * estimate[own].T_wc.translation();
  }
  return {R, t / static_cast<double>(pairs.size())};
}

}  // namespace ipl_slam
