#include "dynamics/shape_similarity.hpp"

#include <cmath>

namespace ipl_slam {

double hu_similarity(const HuInvariants& a, const HuInvariants& b) {
  const auto m = [](double h) { return (h < 0.0 ? -1.0 : 1.0) * std::log10(std::abs(h)); };
  double d = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (std::abs(a[i]) <= kHuFloor || std::abs(b[i]) <= kHuFloor) continue;
    d += std::abs(m(a[i]) - m(b[i]));
  }
  return 1.0 / (1.0 + d);
}

double shape_similarity(double iou, double hu_similarity, double iou_weight) {
  return iou_weight * iou + (1.0 - iou_weight) * hu_similarity;
}

double shape_similarity(const BitMask& a, const BitMask& b, double iou_weight) {
  if (a.none() || b.none()) return 0.0;
  const double hu = hu_similarity(hu_invariants(mask_moments(a)), hu_invariants(mask_moments(b)));
  return shape_similarity(iou(a, b), hu, iou_weight);
}

}  // namespace ipl_slam
