#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace ipl_slam {

/// Stamps this far apart, in seconds, or further, do not belong together: the TUM benchmark's window.
inline constexpr double kAssociationWindow = 0.02;

/// Pairs two lists of timestamps (seconds, strictly increasing) as the TUM RGB-D benchmark defines it (Sturm
/// et al., IROS 2012): of all pairs closer than `max_difference` the closest one is taken first, its two
/// stamps are used up, and so on; of equally close pairs the one with the earlier stamps comes first. Returns
/// (index in first, index in second) in order of the first index.
[[nodiscard]] std::vector<std::pair<std::size_t, std::size_t>> associate(
    std::span<const double> first, std::span<const double> second,
    double max_difference = kAssociationWindow);

}  // namespace ipl_slam
