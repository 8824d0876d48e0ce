#pragma once

#include <optional>
#include <span>
#include <vector>

namespace ipl_slam {

/// alpha_p = (d_max - d) / (d_max - d_min), in [0, 1] (paper, section 3.5): `distances` are those between the
/// two 3-D points of each match with the camera's motion removed, metres; nothing = no match or no valid
/// depth, a value that is negative or not finite counts likewise. d_max and d_min are those of the known
/// distances. A weight below `min_weight` is 0: dropped. A point whose distance is not known has weight 1,
/// and so have all where d_max = d_min: nothing speaks against them.
[[nodiscard]] std::vector<double> point_weights(std::span<const std::optional<double>> distances,
                                                double min_weight);

/// The form of alpha_p with fixed bounds, for a residual beside its own noise: d = sqrt(chi2 / components) is
/// its deviation, d_min = 1 that of noise alone, d_max = sqrt(max_chi2 / components) the one from which on it
/// is called motion, with weight 0. A weight below `min_weight` is 0: dropped.
[[nodiscard]] double residual_weight(double chi2, int components, double max_chi2, double min_weight);

/// alpha_l = cos(theta_avg), clipped to [0, 1]; 0 below `min_weight` (paper, section 3.5). `angle`: theta_avg
/// in rad; nothing or a value that is not finite = no match, weight 1.
[[nodiscard]] double line_weight(std::optional<double> angle, double min_weight);

}  // namespace ipl_slam
