#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "dataset/trajectory.hpp"

namespace ipl_slam::testing {

/// Time between poses, s: exact in binary, so that times add up without rounding and 8 poses are a second.
inline constexpr double kStep = 0.125;

/// Poses at these positions, kStep apart, not turned.
inline Trajectory trajectory_of(const std::vector<Eigen::Vector3d>& positions, double start = 100.0) {
  Trajectory trajectory;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    trajectory.push_back(
        {start + kStep * static_cast<double>(i), SE3(Eigen::Quaterniond::Identity(), positions[i])});
  }
  return trajectory;
}

/// Straight along x at a speed in m/s, turning about z at a rate in degrees/s.
inline Trajectory steady_motion(std::size_t poses, double speed, double degrees_per_second = 0.0) {
  Trajectory trajectory;
  for (std::size_t i = 0; i < poses; ++i) {
    const double t = kStep * static_cast<double>(i);
    const Eigen::AngleAxisd turn(t * degrees_per_second * std::numbers::pi / 180.0, Eigen::Vector3d::UnitZ());
    trajectory.push_back({100.0 + t, SE3(Eigen::Quaterniond(turn), Eigen::Vector3d(speed * t, 0.0, 0.0))});
  }
  return trajectory;
}

/// The same camera path seen from another world frame.
inline Trajectory moved(const SE3& T, Trajectory trajectory) {
  for (StampedPose& pose : trajectory) pose.T_wc = T * pose.T_wc;
  return trajectory;
}

inline SE3 some_motion() {
  Vector6d twist;
  twist << 3.0, -2.0, 1.0, 0.4, -1.1, 0.7;
  return SE3::exp(twist);
}

/// A cross of four points around the origin, 1 m and 2 m out, scaled. Its best alignment to itself at any
/// scale is the identity, so that the errors at scale 1 + s are s, s, 2s and 2s.
inline Trajectory cross(double scale) {
  return trajectory_of({scale * Eigen::Vector3d(1, 0, 0), scale * Eigen::Vector3d(-1, 0, 0),
                        scale * Eigen::Vector3d(0, 2, 0), scale * Eigen::Vector3d(0, -2, 0)});
}

}  // namespace ipl_slam::testing
