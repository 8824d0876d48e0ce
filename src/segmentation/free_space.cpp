#include "segmentation/free_space.hpp"

#include <cstdint>
#include <limits>

#include <opencv2/imgproc.hpp>

namespace ipl_slam {

FreeSpaceMemory::FreeSpaceMemory(const WorkingGrid& grid, const FreeSpaceOptions& options)
    : grid_(grid), options_(options) {}

FreeSpaceEvidence FreeSpaceMemory::evidence(const cv::Mat& inverse_depth, const SE3& T_wc) const {
  FreeSpaceEvidence result{cv::Mat::zeros(grid_.size(), CV_8UC1), cv::Mat::zeros(grid_.size(), CV_8UC1)};
  auto* entered = result.entered.ptr<std::uint8_t>();
  auto* agreed = result.agreed.ptr<std::uint8_t>();
  const auto* inverse = inverse_depth.ptr<float>();
  const int cells = grid_.size().area();
  const float* ray_x = grid_.ray_x().data();
  const float* ray_y = grid_.ray_y().data();
  for (const View& view : views_) {
    const GridTransform T(view.T_cw * T_wc);
    const auto* farthest = view.farthest.ptr<float>();
    const auto* nearest = view.nearest.ptr<float>();
    for (int i = 0; i < cells; ++i) {
      const float w = inverse[i];
      if (w <= 0.0F) continue;
      // The point divided by its depth z = 1/w: R (x/z, y/z, 1) + w t; its third component is z'/z.
      const float x = T.r[0][0] * ray_x[i] + T.r[0][1] * ray_y[i] + T.r[0][2] + w * T.t[0];
      const float y = T.r[1][0] * ray_x[i] + T.r[1][1] * ray_y[i] + T.r[1][2] + w * T.t[1];
      const float z = T.r[2][0] * ray_x[i] + T.r[2][1] * ray_y[i] + T.r[2][2] + w * T.t[2];
      if (z <= 0.0F) continue;
      const float scale = 1.0F / z;
      const int cell = grid_.cell_of_ray(x * scale, y * scale);
      if (cell < 0 || farthest[cell] > nearest[cell]) continue;
      const float there = w * scale;
      if (there > nearest[cell]) {
        ++entered[i];
      } else if (there >= farthest[cell]) {
        ++agreed[i];
      }
    }
  }
  return result;
}

void FreeSpaceMemory::add(const cv::Mat& inverse_depth, const SE3& T_wc, double timestamp) {
  while (!views_.empty() && timestamp - views_.front().timestamp > options_.memory) views_.pop_front();
  if (!views_.empty() && timestamp - views_.back().timestamp < options_.interval) return;
  View view;
  view.timestamp = timestamp;
  view.T_cw = T_wc.inverse();
  const auto tolerance = static_cast<float>(options_.tolerance);
  constexpr float kNever = std::numeric_limits<float>::max();
  const cv::Mat none = inverse_depth <= 0.0F;
  cv::Mat padded = inverse_depth.clone();
  cv::dilate(padded, view.nearest, cv::Mat());
  padded.setTo(kNever, none);
  cv::erode(padded, view.farthest, cv::Mat());
  view.nearest += tolerance;
  view.farthest -= tolerance;
  view.farthest.setTo(kNever, none);
  views_.push_back(std::move(view));
}

}  // namespace ipl_slam
