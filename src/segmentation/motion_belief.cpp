#include "segmentation/motion_belief.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include <opencv2/imgproc.hpp>

namespace ipl_slam {

namespace {

// Depth of 1/this and less counts as this far when steps are taken relative to it: the noise of far surfaces
// does not shrink with their inverse depth, 1/m.
constexpr float kFarInverseDepth = 0.5F;

// Where depth is missing, and beyond, evidence spreads as far as here: the far end of what depth cameras see,
// 1/m.
constexpr float kLeastInverseDepth = 0.3F;

// Between a cell with depth and one without the filter passes this share at most: depth is missing at edges
// more often than elsewhere.
constexpr float kToMissingDepth = 0.5F;

// Cells of two frames whose depth differs by more than this share show different things. Wider than the
// noise: what moves also moves in depth between the frames.
constexpr float kSameSurface = 0.15F;

// Side of the window in which most cells must agree, cells.
constexpr int kLineWindow = 3;

// Keeps the division of belief by weight defined where all weights are 0.
constexpr float kTinyWeight = 1e-6F;

// focal_length: in cells.
float conductance_between(float inverse_a, float inverse_b, int grey_a, int grey_b, float focal_length,
                          const MotionBeliefOptions& options) {
  // The decay per cell that gives the recursive filter, run both ways, a deviation of `reach`.
  const float reach =
      static_cast<float>(options.reach) * focal_length * std::max({inverse_a, inverse_b, kLeastInverseDepth});
  const float base = std::exp(-std::numbers::sqrt2_v<float> / reach);
  if (inverse_a > 0.0F && inverse_b > 0.0F) {
    const float step =
        static_cast<float>(options.depth_step) * std::max({inverse_a, inverse_b, kFarInverseDepth});
    return base * std::exp(-std::max(0.0F, std::abs(inverse_a - inverse_b) - step) / step);
  }
  const float grey = static_cast<float>(std::abs(grey_a - grey_b)) / static_cast<float>(options.grey_step);
  const bool one_missing = inverse_a > 0.0F || inverse_b > 0.0F;
  return (one_missing ? kToMissingDepth : 1.0F) * base * std::exp(-grey);
}

}  // namespace

Conductance surface_conductance(const GridFrame& frame, const WorkingGrid& grid,
                                const MotionBeliefOptions& options) {
  const cv::Size size = grid.size();
  const float focal_length = grid.focal_length();
  Conductance result{cv::Mat::zeros(size, CV_32FC1), cv::Mat::zeros(size, CV_32FC1)};
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
        right[x] =
            conductance_between(inverse[x], inverse[x + 1], grey[x], grey[x + 1], focal_length, options);
      }
      if (!last) {
        below[x] =
            conductance_between(inverse[x], inverse_below[x], grey[x], grey_below[x], focal_length, options);
      }
    }
  }
  return result;
}

MotionBelief::MotionBelief(const WorkingGrid& grid, const MotionBeliefOptions& options)
    : grid_(grid), options_(options) {}

// What was believed about each cell where the other frame saw it, had it not moved since; 0 where unknown.
cv::Mat MotionBelief::carried(const Past& from, const cv::Mat& belief, const cv::Mat& inverse_depth,
                              const SE3& T_wc) const {
  cv::Mat result = cv::Mat::zeros(grid_.size(), CV_32FC1);
  const GridTransform T(from.T_wc.inverse() * T_wc);
  auto* out = result.ptr<float>();
  const auto* inverse = inverse_depth.ptr<float>();
  const auto* there_inverse = from.inverse_depth.ptr<float>();
  const auto* there_belief = belief.ptr<float>();
  const float* ray_x = grid_.ray_x().data();
  const float* ray_y = grid_.ray_y().data();
  for (int i = 0; i < grid_.size().area(); ++i) {
    const GridPoint p = T.apply(ray_x[i], ray_y[i], inverse[i]);
    if (p.z <= 0.0F) continue;
    const int cell = grid_.cell_of_ray(p.x / p.z, p.y / p.z);
    if (cell < 0) continue;
    const float here = inverse[i] / p.z, there = there_inverse[cell];
    if (here <= 0.0F || there <= 0.0F) continue;  // nothing tells whether it is the same
    if (std::abs(here - there) <= kSameSurface * std::max(there, kFarInverseDepth))
      out[i] = there_belief[cell];
  }
  return result;
}

// The cells that stand in space which enough of the views saw to be free. Lines one cell wide are dropped: an
// edge of depth makes such where the pose is not exact.
cv::Mat MotionBelief::entered(const FreeSpaceEvidence& evidence, int min_free) const {
  cv::Mat result(grid_.size(), CV_8UC1);
  const auto* free = evidence.free.ptr<std::uint8_t>();
  const auto* taken = evidence.taken.ptr<std::uint8_t>();
  auto* out = result.ptr<std::uint8_t>();
  const auto share = static_cast<float>(options_.free_share);
  for (int i = 0; i < grid_.size().area(); ++i) {
    const bool enough =
        free[i] >= min_free && static_cast<float>(free[i]) >= share * static_cast<float>(free[i] + taken[i]);
    out[i] = enough ? 255 : 0;
  }
  cv::Mat thick;
  cv::medianBlur(result, thick, kLineWindow);
  return result & thick;
}

cv::Mat MotionBelief::averaged(const FreeSpaceEvidence& evidence, int min_free, const cv::Mat& prior,
                               const Conductance& conductance) const {
  const cv::Mat in_free_space = entered(evidence, min_free);
  cv::Mat sums(grid_.size(), CV_32FC2);  // of belief times weight, and of weight
  const int cells = grid_.size().area();
  const auto* moved = in_free_space.ptr<std::uint8_t>();
  const auto* free = evidence.free.ptr<std::uint8_t>();
  const auto* taken = evidence.taken.ptr<std::uint8_t>();
  const auto* before = prior.ptr<float>();
  auto* sum = sums.ptr<cv::Vec2f>();
  const auto taken_weight = static_cast<float>(options_.taken_weight / options_.full_taken);
  const auto memory_weight = static_cast<float>(options_.memory_weight);
  const auto bias = static_cast<float>(options_.bias);
  const auto unseen_bias = static_cast<float>(options_.unseen_bias);
  for (int i = 0; i < cells; ++i) {
    // Weights of moving and of being static.
    float moving = moved[i] != 0 ? 1.0F : 0.0F;
    float still = free[i] + taken[i] == 0 ? unseen_bias : bias;
    if (moved[i] == 0)
      still += taken_weight * static_cast<float>(std::min<int>(taken[i], options_.full_taken));
    (before[i] > 0.0F ? moving : still) += memory_weight * std::abs(before[i]);
    sum[i] = {moving - still, moving + still};
  }
  filter_along_surfaces(sums, conductance, options_.passes);
  cv::Mat belief(grid_.size(), CV_32FC1);
  auto* out = belief.ptr<float>();
  for (int i = 0; i < cells; ++i) out[i] = sum[i][0] / (sum[i][1] + kTinyWeight);
  return belief;
}

const cv::Mat& MotionBelief::update(const GridFrame& frame, const SE3& T_wc, double timestamp,
                                    const FreeSpaceEvidence& evidence, const Conductance& conductance,
                                    const FreeSpaceView& view) {
  Past now{timestamp, T_wc, frame.inverse_depth, conductance, {}};
  cv::Mat prior = cv::Mat::zeros(grid_.size(), CV_32FC1);
  if (!past_.empty()) {
    // The last frame that is at least as old as hindsight asks for, or the oldest there is.
    while (past_.size() > 1 && timestamp - past_[1].timestamp >= options_.hindsight) past_.pop_front();
    const Past& past = past_.front();
    FreeSpaceEvidence left(grid_.size());
    view.judge(grid_, past.inverse_depth, past.T_wc, left);
    const cv::Mat in_hindsight = averaged(left, 1, past.belief, past.conductance);
    prior = cv::max(carried(past_.back(), past_.back().belief, frame.inverse_depth, T_wc),
                    carried(past, in_hindsight, frame.inverse_depth, T_wc));
  }
  now.belief = averaged(evidence, options_.min_free, prior, now.conductance);
  past_.push_back(std::move(now));
  return past_.back().belief;
}

}  // namespace ipl_slam
