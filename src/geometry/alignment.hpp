#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include <Eigen/Core>

#include "geometry/se3.hpp"

namespace ipl_slam {

/// The rigid transform T_ba that minimises sum |b_i - T_ba a_i|^2 (Umeyama, "Least-squares estimation of
/// transformation parameters between two point patterns", 1991, without scale). Metres. Nothing is returned
/// for fewer than three pairs, for numbers that are not finite, and where the points lie on a line (or in one
/// spot), which leaves the rotation about it open. Throws std::invalid_argument where the two sides differ in
/// number.
[[nodiscard]] std::optional<SE3> align_rigid(std::span<const Eigen::Vector3d> points_a,
                                             std::span<const Eigen::Vector3d> points_b);

/// align_rigid for ransac(): the error is the distance |b_i - T_ba a_i| in metres. Refers to the points,
/// which must outlive it.
class RigidAlignmentEstimator {
 public:
  using Model = SE3;
  static constexpr std::size_t kSampleSize = 3;

  RigidAlignmentEstimator(std::span<const Eigen::Vector3d> points_a,
                          std::span<const Eigen::Vector3d> points_b);

  [[nodiscard]] std::size_t size() const { return points_a_.size(); }
  [[nodiscard]] std::optional<SE3> fit(std::span<const std::uint32_t> indices) const;
  [[nodiscard]] double squared_error(const SE3& T_ba, std::uint32_t index) const {
    return (points_b_[index] - T_ba * points_a_[index]).squaredNorm();
  }

 private:
  std::span<const Eigen::Vector3d> points_a_, points_b_;
};

}  // namespace ipl_slam
