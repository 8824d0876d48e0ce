#pragma once

#include <optional>
#include <span>

#include "common/random.hpp"
#include "geometry/camera.hpp"
#include "geometry/ransac.hpp"
#include "tracking/pose_optimizer.hpp"

namespace ipl_slam {

/// T_cw of a camera from matches with known points, many of which may be wrong, by RANSAC: from three points
/// whose depth the camera measured their rigid motion, from three others the perspective-three-point problem.
/// The error that is compared with `options.threshold` is that of reprojection, in pixels of the keypoint's
/// pyramid level: a fairer measure than metres, which a far point's depth alone can use up. Weights are not
/// used.
[[nodiscard]] std::optional<RansacResult<SE3>> absolute_pose(const Camera& camera,
                                                             std::span<const PointMatch> matches,
                                                             const RansacOptions& options, Random& random);

}  // namespace ipl_slam
