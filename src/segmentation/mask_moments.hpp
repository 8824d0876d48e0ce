#pragma once

#include <array>
#include <cstdint>

#include "segmentation/bit_mask.hpp"

namespace ipl_slam {

/// Sums of weight * x^p * y^q over pixels or samples, up to third order: m<p><q>.
template <class Number>
struct Moments {
  Number m00{}, m10{}, m01{}, m20{}, m11{}, m02{}, m30{}, m21{}, m12{}, m03{};
  friend bool operator==(const Moments&, const Moments&) = default;
};

/// Moments of a mask about pixel (0, 0), each pixel a point of weight 1 at its centre: exact integers. Sides
/// of the mask up to 8192 pixels.
[[nodiscard]] Moments<std::int64_t> mask_moments(const BitMask& mask);

/// Hu's seven invariants of a shape: they do not change when it is shifted, scaled or turned (Hu, "Visual
/// pattern recognition by moment invariants", IRE Transactions on Information Theory, 1962). All 0 for an
/// empty shape.
using HuInvariants = std::array<double, 7>;
[[nodiscard]] HuInvariants hu_invariants(const Moments<std::int64_t>& moments);
/// The same for moments that are not integers; their origin should lie near the shape, since large moments
/// cancel.
[[nodiscard]] HuInvariants hu_invariants(const Moments<double>& moments);

}  // namespace ipl_slam
