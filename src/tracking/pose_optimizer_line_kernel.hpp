#pragma once

#include "geometry/camera.hpp"
#include "geometry/se3.hpp"
#include "tracking/pose_optimizer_lanes.hpp"

// The lines' part of the inner loop of the pose optimiser: residuals of both observed end points and
// of the depth measured there (geometry/line_reprojection.hpp), robust weights and normal equations, four
// lines at a time.

namespace ipl_slam::pose_kernel {

/// What the table holds per line.
enum LineField : std::size_t {
  kMomentX,            ///< n of the line in the world, m
  kMomentY,            //
  kMomentZ,            //
  kDirectionX,         ///< d of the line in the world
  kDirectionY,         //
  kDirectionZ,         //
  kStartU,             ///< observed end points, undistorted pixels
  kStartV,             //
  kEndU,               //
  kEndV,               //
  kLineInfo,           ///< 1 / variance of an end point across the line, 1/pixel^2
  kStartInverseDepth,  ///< measured at the end points, 1/m
  kEndInverseDepth,    //
  kStartDepthInfo,     ///< 1 / variance of the inverse depth, m^2; 0 = no depth measured
  kEndDepthInfo,       //
  kLineHuber,          ///< where Huber's kernel turns linear, standard deviations
  kLineWeight,         ///< alpha_l; 0 = takes no part
  kLineChi2,           ///< output of evaluate_lines()
  kLineFields
};

using LineTable = LaneTable<LineField, kLineFields>;

/// Evaluates all lines at T_cw and adds their share to `out`; otherwise as evaluate(). A line has no residual
/// where it passes (nearly) through the camera centre or has an observed end point whose ray meets it behind
/// the camera or not at all; its chi-square is then kBehindCameraChi2.
void evaluate_lines(const Camera& camera, const SE3& T_cw, bool robust, LineTable& table, Normal& out);

/// The version for processors without AVX2.
void evaluate_lines_portable(const Camera& camera, const SE3& T_cw, bool robust, LineTable& table,
                             Normal& out);

}  // namespace ipl_slam::pose_kernel
