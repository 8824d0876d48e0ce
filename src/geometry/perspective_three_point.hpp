#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

namespace ipl_slam {

/// The perspective-three-point problem: how far three known points are from a camera that sees them along
/// three rays (unit vectors, camera frame). Each solution holds the three distances, metres, all positive;
/// there are up to four, in ascending order of the third distance over the first. None where two points or
/// two rays fall together, or numbers are not finite. Source: Grunert's solution as given by Haralick, Lee,
/// Ottenberg and Noelle, "Review and analysis of solutions of the three point perspective pose estimation
/// problem", IJCV 1994, with the roots polished by Newton steps on the three laws of cosines.
[[nodiscard]] std::vector<Eigen::Vector3d> three_point_distances(const std::array<Eigen::Vector3d, 3>& points,
                                                                 const std::array<Eigen::Vector3d, 3>& rays);

}  // namespace ipl_slam
