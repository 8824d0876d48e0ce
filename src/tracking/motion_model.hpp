#pragma once

#include "geometry/se3.hpp"

namespace ipl_slam {

/// Constant-velocity prediction (paper section 3.5). The velocity is a twist in the camera frame per second,
/// so that a dropped frame does not halve the predicted motion.
class MotionModel {
 public:
  /// Takes the pose of a tracked frame. A pose that follows another one gives a velocity.
  void update(double timestamp, const SE3& T_cw) {
    const double dt = timestamp - timestamp_;
    velocity_ = known_ && dt > 0.0 ? Vector6d((T_cw * T_cw_.inverse()).log() / dt) : Vector6d::Zero();
    known_ = true;
    timestamp_ = timestamp;
    T_cw_ = T_cw;
  }
  /// T_cw expected at `timestamp`.
  [[nodiscard]] SE3 predict(double timestamp) const {
    return SE3::exp(velocity_ * (timestamp - timestamp_)) * T_cw_;
  }
  /// The map moved under the camera: the same place is now T_cw. The velocity, being the camera's own, stays.
  void rebase(const SE3& T_cw) { T_cw_ = T_cw; }
  /// Forgets the velocity; the last pose stays.
  void stop() {
    velocity_.setZero();
    known_ = false;
  }
  [[nodiscard]] const SE3& last_pose() const { return T_cw_; }

 private:
  SE3 T_cw_;
  Vector6d velocity_ = Vector6d::Zero();
  double timestamp_ = 0.0;
  bool known_ = false;
};

}  // namespace ipl_slam
