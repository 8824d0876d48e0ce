#include "geometry/alignment.hpp"

#include <stdexcept>
#include <vector>

#include <Eigen/SVD>

namespace ipl_slam {
namespace {

// The second singular value of the cross-covariance over the first, below which the points count as
// collinear. It is about the squared ratio of a cloud's width to its length: 1e-9 is 3 mm of width in 100 m
// of length.
constexpr double kCollinear = 1e-9;

}  // namespace

std::optional<SE3> align_rigid(std::span<const Eigen::Vector3d> points_a,
                               std::span<const Eigen::Vector3d> points_b) {
  if (points_a.size() != points_b.size())
    throw std::invalid_argument("align_rigid: the two sides differ in number of points");
  if (points_a.size() < 3) return std::nullopt;

  Eigen::Vector3d mean_a = Eigen::Vector3d::Zero(), mean_b = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < points_a.size(); ++i) mean_a += points_a[i], mean_b += points_b[i];
  mean_a /= static_cast<double>(points_a.size());
  mean_b /= static_cast<double>(points_a.size());
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < points_a.size(); ++i)
    covariance += (points_b[i] - mean_b) * (points_a[i] - mean_a).transpose();
  if (!covariance.allFinite()) return std::nullopt;

  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d s = svd.singularValues();
  if (!(s[1] > kCollinear * s[0])) return std::nullopt;
  // Of the two orthogonal matrices that fit, the one that is a rotation: a reflection would fit noisy planes
  // better.
  const double sign = svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0 ? -1.0 : 1.0;
  const Eigen::Matrix3d R =
      svd.matrixU() * Eigen::Vector3d(1.0, 1.0, sign).asDiagonal() * svd.matrixV().transpose();
  return SE3(R, mean_b - R * mean_a);
}

RigidAlignmentEstimator::RigidAlignmentEstimator(std::span<const Eigen::Vector3d> points_a,
                                                 std::span<const Eigen::Vector3d> points_b)
    : points_a_(points_a), points_b_(points_b) {
  if (points_a.size() != points_b.size())
    throw std::invalid_argument("RigidAlignmentEstimator: the two sides differ in number of points");
}

std::optional<SE3> RigidAlignmentEstimator::fit(std::span<const std::uint32_t> indices) const {
  std::vector<Eigen::Vector3d> a, b;
  a.reserve(indices.size()), b.reserve(indices.size());
  for (const std::uint32_t i : indices) a.push_back(points_a_[i]), b.push_back(points_b_[i]);
  return align_rigid(a, b);
}

}  // namespace ipl_slam
