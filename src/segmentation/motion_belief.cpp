#include "segmentation/motion_belief.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace ipl_slam {

namespace {

// Depth of 1/this and less counts as this far when steps are taken relative to it: the noise of far surfaces
// does not shrink with their inverse depth, 1/m.
constexpr float kFarInverseDepth = 0.5F;

// Between a cell with depth and one without the filter passes this share at most: depth is missing at edges
// more often than elsewhere.
constexpr float kToMissingDepth = 0.7F;

// Cells of two frames whose inverse depth differs by more show different things, 1/m. Wider than the noise:
// what moves also moves in depth between two frames.
constexpr float kSameSurface = 0.06F;

float conductance_between(float inverse_a, float inverse_b, int grey_a, int grey_b, float base,
                          const MotionBeliefOptions& options) {
  float distance = static_cast<float>(std::abs(grey_a - grey_b)) / static_cast<float>(options.grey_step);
  float factor = 1.0F;
  if (inverse_a > 0.0F && inverse_b > 0.0F) {
    const float step = static_cast<float>(options.depth_step) *
                       std::max({inverse_a, inverse_b, kFarInverseDepth});
    distance += std::max(0.0F, std::abs(inverse_a - inverse_b) - step) / step;
  } else if (inverse_a > 0.0F || inverse_b > 0.0F) {
    factor = kToMissingDepth;
  }
  return factor * base * std::exp(-distance);
}

}  // namespace

Conductance surface_conductance(const GridFrame& frame, const MotionBeliefOptions& options) {
  const cv::Size size = frame.grey.size();
  Conductance result{cv::Mat::zeros(size, CV_32FC1), cv::Mat::zeros(size, CV_32FC1)};
  // The decay per cell that gives the recursive filter, run both ways, a deviation of `reach` cells.
  const auto base = static_cast<float>(std::exp(-std::sqrt(2.0) / options.reach));
  for (int y = 0; y < size.height; ++y) {
    const bool last = y + 1 == size.height;
    const auto* grey = frame.grey.ptr<std::uint8_t>(y);
    const auto* inverse = frame.inverse_depth.ptr<float>(y);
    const auto* grey_below = frame.grey.ptr<std::uint8_t>(last ? y : y + 1);
    const auto* inverse_below = frame.inverse_depth.ptr<float>(last ? y : y + 1);
    auto* right = result.to_right.ptr<float>(y);
    auto* below = result.to_below.ptr<float>(y);
    for (int x = 0; x < size.width; ++x) {
      if (x + 1 < size.width) {
        right[x] = conductance_between(inverse[x], inverse[x + 1], grey[x], grey[x + 1], base, options);
      }
      if (!last) {
        below[x] = conductance_between(inverse[x], inverse_below[x], grey[x], grey_below[x], base, options);
      }
    }
  }
  return result;
}

MotionBelief::MotionBelief(const WorkingGrid& grid, const MotionBeliefOptions& options)
    : grid_(grid), options_(options) {}

// What was believed about each cell where the last frame saw it, had it not moved since; 0 where unknown.
cv::Mat MotionBelief::carried(const GridFrame& frame, const SE3& T_wc) const {
  cv::Mat result = cv::Mat::zeros(grid_.size(), CV_32FC1);
  if (belief_.empty()) return result;
  const GridTransform T(T_wc_.inverse() * T_wc);
  auto* out = result.ptr<float>();
  const auto* inverse = frame.inverse_depth.ptr<float>();
  const auto* old_inverse = inverse_depth_.ptr<float>();
  const auto* belief = belief_.ptr<float>();
  for (int i = 0; i < grid_.size().area(); ++i) {
    const float rx = grid_.ray_x()[static_cast<std::size_t>(i)];
    const float ry = grid_.ray_y()[static_cast<std::size_t>(i)];
    const float w = inverse[i];
    const float x = T.r[0][0] * rx + T.r[0][1] * ry + T.r[0][2] + w * T.t[0];
    const float y = T.r[1][0] * rx + T.r[1][1] * ry + T.r[1][2] + w * T.t[1];
    const float z = T.r[2][0] * rx + T.r[2][1] * ry + T.r[2][2] + w * T.t[2];
    if (z <= 0.0F) continue;
    const int cell = grid_.cell_of_ray(x / z, y / z);
    if (cell < 0) continue;
    if (w > 0.0F && old_inverse[cell] > 0.0F && std::abs(old_inverse[cell] - w / z) > kSameSurface) continue;
    out[i] = belief[cell];
  }
  return result;
}

const cv::Mat& MotionBelief::update(const GridFrame& frame, const SE3& T_wc,
                                    const FreeSpaceEvidence& evidence, const Conductance& conductance) {
  const cv::Mat before = carried(frame, T_wc);
  cv::Mat sums(grid_.size(), CV_32FC2);  // of evidence times weight, and of weight
  const int cells = grid_.size().area();
  const auto* entered = evidence.entered.ptr<std::uint8_t>();
  const auto* agreed = evidence.agreed.ptr<std::uint8_t>();
  const auto* prior = before.ptr<float>();
  auto* sum = sums.ptr<cv::Vec2f>();
  const auto agreed_weight = static_cast<float>(options_.agreed_weight);
  const auto memory_weight = static_cast<float>(options_.memory_weight);
  const auto bias = static_cast<float>(options_.bias);
  for (int i = 0; i < cells; ++i) {
    float value = -bias + memory_weight * prior[i];
    float weight = bias + memory_weight * std::abs(prior[i]);
    if (entered[i] >= options_.min_entered &&
        entered[i] >= options_.entered_share * (entered[i] + agreed[i])) {
      value += 1.0F;
      weight += 1.0F;
    } else if (agreed[i] > 0) {
      value -= agreed_weight;
      weight += agreed_weight;
    }
    sum[i] = {value, weight};
  }
  filter_along_surfaces(sums, conductance, options_.passes);
  belief_.create(grid_.size(), CV_32FC1);
  auto* belief = belief_.ptr<float>();
  for (int i = 0; i < cells; ++i) belief[i] = sum[i][0] / (sum[i][1] + 1e-6F);
  inverse_depth_ = frame.inverse_depth;
  T_wc_ = T_wc;
  return belief_;
}

}  // namespace ipl_slam
