#pragma once

#include <string>

#include "dataset/synthetic/scene.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam::synthetic {

/// Pose of a camera at `eye` (world, z up) that looks at `target`, its x-axis level.
[[nodiscard]] SE3 look_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target);

/// T_wc of the camera at a time (seconds) on one of the paths below. All are smooth, at most 0.5 m/s (walk:
/// 0.7 m/s, loop: 1 m/s) and 40 deg/s (loop: 60 deg/s) fast, and stay where the site says there is room.
///   orbit       around the middle of the room, looking inwards
///   sweep       to and fro along one wall, swinging from side to side
///   walk        along the same line, looking ahead and about; turns round at its ends
///   loop        once round the building and on into the next round, looking ahead and about
///   xyz         at the station, shifts along each axis in turn without turning
///   rpy         at the station, turns about each axis in turn without shifting
///   halfsphere  at the station, on a sphere about what is interesting
///   static      at the station, quite still
/// Throws UserError for any other name.
[[nodiscard]] SE3 camera_pose(const std::string& path, const CameraSite& site, double time);

}  // namespace ipl_slam::synthetic
