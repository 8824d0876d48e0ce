#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace ipl_slam {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Rigid-body transform x' = R x + t, the project's one pose type. A variable named T_ab maps coordinates of
/// frame b into frame a: T_cw takes world points into the camera, T_wc = T_cw.inverse() is the camera's pose
/// in the world. Lengths in metres. The camera frame is x right, y down, z forward.
class SE3 {
 public:
  SE3() = default;
  SE3(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation)
      : q_(rotation.normalized()), t_(translation) {}
  SE3(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation)
      : SE3(Eigen::Quaterniond(rotation), translation) {}

  /// Of a quaternion that is known to have unit length: it is kept to the bit, which normalising it once more
  /// would not.
  [[nodiscard]] static SE3 of_unit(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation) {
    SE3 T;
    T.q_ = rotation;
    T.t_ = translation;
    return T;
  }

  /// Exponential map of a twist (rho, phi): first the translational, then the rotational part (radians).
  /// Source: Sola et al., "A micro Lie theory for state estimation in robotics", 2018.
  [[nodiscard]] static SE3 exp(const Vector6d& twist);
  /// Inverse of exp: the twist (rho, phi) with |phi| <= pi.
  [[nodiscard]] Vector6d log() const;

  [[nodiscard]] SE3 inverse() const {
    const Eigen::Quaterniond q = q_.conjugate();
    return {q, -(q * t_)};
  }
  [[nodiscard]] SE3 operator*(const SE3& other) const { return {q_ * other.q_, q_ * other.t_ + t_}; }
  [[nodiscard]] Eigen::Vector3d operator*(const Eigen::Vector3d& point) const { return q_ * point + t_; }

  [[nodiscard]] const Eigen::Quaterniond& rotation() const { return q_; }
  [[nodiscard]] Eigen::Matrix3d rotation_matrix() const { return q_.toRotationMatrix(); }
  [[nodiscard]] const Eigen::Vector3d& translation() const { return t_; }
  /// Angle of the rotation in radians, in [0, pi].
  [[nodiscard]] double angle() const;

 private:
  Eigen::Quaterniond q_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d t_ = Eigen::Vector3d::Zero();
};

/// The matrix [v]x with [v]x w = v x w.
[[nodiscard]] Eigen::Matrix3d skew(const Eigen::Vector3d& v);

}  // namespace ipl_slam
