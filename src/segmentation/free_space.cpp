#include "segmentation/free_space.hpp"

#include <cstdint>
#include <limits>

#include <opencv2/imgproc.hpp>

namespace ipl_slam {

namespace {

// One more view; 255 stand for all beyond.
void count(std::uint8_t& views) {
  if (views < std::numeric_limits<std::uint8_t>::max()) ++views;
}

}  // namespace

FreeSpaceView::FreeSpaceView(const cv::Mat& inverse_depth, const SE3& T_wc, double tolerance)
    : T_cw_(T_wc.inverse()) {
  constexpr float kNever = std::numeric_limits<float>::max();
  const cv::Mat none = inverse_depth <= 0.0F;
  cv::dilate(inverse_depth, nearest_, cv::Mat());
  cv::Mat padded = inverse_depth.clone();
  padded.setTo(kNever, none);
  cv::erode(padded, farthest_, cv::Mat());
  nearest_ += tolerance;
  farthest_ -= tolerance;
  farthest_.setTo(kNever, none);
}

void FreeSpaceView::judge(const WorkingGrid& grid, const cv::Mat& inverse_depth, const SE3& T_wc,
                          FreeSpaceEvidence& evidence) const {
  const GridTransform T(T_cw_ * T_wc);
  const float* ray_x = grid.ray_x().data();
  const float* ray_y = grid.ray_y().data();
  const auto* inverse = inverse_depth.ptr<float>();
  const auto* farthest = farthest_.ptr<float>();
  const auto* nearest = nearest_.ptr<float>();
  auto* free = evidence.free.ptr<std::uint8_t>();
  auto* taken = evidence.taken.ptr<std::uint8_t>();
  const int cells = grid.size().area();
  for (int i = 0; i < cells; ++i) {
    const float w = inverse[i];
    if (w <= 0.0F) continue;
    const GridPoint p = T.apply(ray_x[i], ray_y[i], w);
    if (p.z <= 0.0F) continue;
    const float scale = 1.0F / p.z;
    const int cell = grid.cell_of_ray(p.x * scale, p.y * scale);
    if (cell < 0 || farthest[cell] > nearest[cell]) continue;
    const float here = w * scale;
    if (here > nearest[cell]) {
      count(free[i]);
    } else if (here >= farthest[cell]) {
      count(taken[i]);
    }
  }
}

void FreeSpaceView::distrust(const cv::Mat& moving) {
  // No inverse depth is between the two any more; cells without depth stay without.
  nearest_.copyTo(farthest_, moving & (farthest_ < nearest_));
}

FreeSpaceMemory::FreeSpaceMemory(const WorkingGrid& grid, const FreeSpaceOptions& options)
    : grid_(grid), options_(options) {}

FreeSpaceEvidence FreeSpaceMemory::evidence(const cv::Mat& inverse_depth, const SE3& T_wc) const {
  FreeSpaceEvidence result(grid_.size());
  for (const Entry& entry : entries_) entry.view.judge(grid_, inverse_depth, T_wc, result);
  return result;
}

void FreeSpaceMemory::add(const FreeSpaceView& view, double timestamp) {
  while (!entries_.empty() && timestamp - entries_.front().timestamp > options_.memory) entries_.pop_front();
  if (!entries_.empty() && timestamp - entries_.back().timestamp < options_.interval) return;
  entries_.push_back({timestamp, view});
}

}  // namespace ipl_slam
