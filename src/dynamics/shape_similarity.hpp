#pragma once

#include "segmentation/bit_mask.hpp"
#include "segmentation/mask_moments.hpp"

namespace ipl_slam {

/// An invariant with |h| up to this is taken for 0: on masks of real objects it is made of the roughness of
/// the outline, and its logarithm (and sign) is arbitrary. It is the value that cv::matchShapes uses.
inline constexpr double kHuFloor = 1e-5;

/// H = 1 / (1 + d), d = sum over i of |m_i(a) - m_i(b)|, m_i = sign(h_i) log10 |h_i|: 1 for shapes that are
/// equal but for place, size and rotation. An invariant that is below kHuFloor in either shape says nothing
/// and is left out, as in cv::matchShapes (CONTOURS_MATCH_I2), so two shapes without any (a single pixel has
/// none) are alike.
[[nodiscard]] double hu_similarity(const HuInvariants& a, const HuInvariants& b);

/// S = iou_weight * IoU + (1 - iou_weight) * H (paper, section 3.3).
[[nodiscard]] double shape_similarity(double iou, double hu_similarity, double iou_weight);

/// The same for two masks as they lie in the image; 0 where either is empty.
[[nodiscard]] double shape_similarity(const BitMask& a, const BitMask& b, double iou_weight);

}  // namespace ipl_slam
