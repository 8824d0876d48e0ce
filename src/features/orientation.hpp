#pragma once

#include <cstddef>
#include <cstdint>

#include "common/cpu.hpp"

namespace ipl_slam {

/// Radius of the disc of pixels that orientation and descriptor are taken from, in pixels of the pyramid
/// level.
inline constexpr int kPatchRadius = 15;
/// Distance a corner keeps from the border of its level. One more than the radius: vector loads are 32 pixels
/// wide.
inline constexpr int kPatchBorder = kPatchRadius + 1;

/// Orientation of the disc of radius kPatchRadius around `center` by its intensity centroid: the direction
/// from the centre to the brightness-weighted mean, radians in [0, 2 pi), x right and y down. A patch without
/// a direction gets 0. `center` must lie kPatchBorder inside its image, whose rows are `step` bytes apart.
/// Source: Rosin, "Measuring corner properties", CVIU 1999, as used by ORB.
[[nodiscard]] float patch_orientation(const std::uint8_t* center, std::ptrdiff_t step,
                                      Simd simd = best_simd());

}  // namespace ipl_slam
