#include "segmentation/cell_regions.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace ipl_slam {

namespace {

void grow(const cv::Mat& on, const Conductance& conductance, double min_conductance, cv::Point start,
          CellRegion& region, cv::Mat& labels) {
  const cv::Rect inside({0, 0}, on.size());
  std::vector<cv::Point> open{start};
  labels.at<int>(start) = region.label;
  const auto visit = [&](cv::Point p, float passes) {
    if (!inside.contains(p) || passes < min_conductance || on.at<std::uint8_t>(p) == 0 ||
        labels.at<int>(p) != 0) {
      return;
    }
    labels.at<int>(p) = region.label;
    open.push_back(p);
  };
  cv::Point low = start, high = start;
  while (!open.empty()) {
    const cv::Point p = open.back();
    open.pop_back();
    ++region.area;
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    visit({p.x + 1, p.y}, conductance.to_right.at<float>(p));
    visit({p.x, p.y + 1}, conductance.to_below.at<float>(p));
    if (p.x > 0) visit({p.x - 1, p.y}, conductance.to_right.at<float>(p.y, p.x - 1));
    if (p.y > 0) visit({p.x, p.y - 1}, conductance.to_below.at<float>(p.y - 1, p.x));
  }
  region.box = {low, high + cv::Point(1, 1)};
}

int count_label(const cv::Mat& labels, cv::Rect box, int label) {
  int count = 0;
  for (int y = box.y; y < box.y + box.height; ++y) {
    const auto* row = labels.ptr<int>(y);
    count += static_cast<int>(std::count(row + box.x, row + box.x + box.width, label));
  }
  return count;
}

// The cell around a pixel whose inverse depth is nearest to the pixel's. The pixel's own cell wins unless
// another is clearly nearer.
cv::Point cell_of_depth(const cv::Mat& inverse_depth, cv::Point own, cv::Rect around, float inverse) {
  constexpr float kOwnCell = 0.02F;  // 1/m
  cv::Point nearest = own;
  float least = std::numeric_limits<float>::max();
  for (int y = around.y; y < around.y + around.height; ++y) {
    for (int x = around.x; x < around.x + around.width; ++x) {
      const float other = inverse_depth.at<float>(y, x);
      if (other <= 0.0F) continue;
      const float distance = std::abs(other - inverse) + (cv::Point(x, y) == own ? 0.0F : kOwnCell);
      if (distance >= least) continue;
      least = distance;
      nearest = {x, y};
    }
  }
  return nearest;
}

}  // namespace

std::vector<CellRegion> connected_regions(const cv::Mat& on, const Conductance& conductance,
                                          double min_conductance, cv::Mat& labels) {
  labels = cv::Mat::zeros(on.size(), CV_32SC1);
  std::vector<CellRegion> regions;
  for (int y = 0; y < on.rows; ++y) {
    for (int x = 0; x < on.cols; ++x) {
      if (on.at<std::uint8_t>(y, x) == 0 || labels.at<int>(y, x) != 0) continue;
      CellRegion& region = regions.emplace_back();
      region.label = static_cast<int>(regions.size());
      grow(on, conductance, min_conductance, {x, y}, region, labels);
    }
  }
  return regions;
}

BitMask region_mask(const CellRegion& region, const cv::Mat& labels, const GridFrame& frame,
                    const cv::Mat& depth, const WorkingGrid& grid) {
  BitMask mask(grid.image_size());
  const cv::Rect all({0, 0}, labels.size());
  const cv::Rect reach =
      cv::Rect(region.box.x - 1, region.box.y - 1, region.box.width + 2, region.box.height + 2) & all;
  for (int y = reach.y; y < reach.y + reach.height; ++y) {
    for (int x = reach.x; x < reach.x + reach.width; ++x) {
      const cv::Rect around = cv::Rect(x - 1, y - 1, 3, 3) & all;
      const int cells = count_label(labels, around, region.label);
      if (cells == 0) continue;
      const int first = grid.image_x(x), last = grid.image_x(x + 1);
      for (int v = grid.image_y(y); v < grid.image_y(y + 1); ++v) {
        if (cells == around.area()) {
          mask.set_run(v, first, last);
          continue;
        }
        const auto* raw = depth.ptr<std::uint16_t>(v);
        for (int u = first; u < last; ++u) {
          const cv::Point cell =
              raw[u] == 0 ? cv::Point(x, y)
                          : cell_of_depth(frame.inverse_depth, {x, y}, around, grid.inverse_of_raw(raw[u]));
          if (labels.at<int>(cell) == region.label) mask.set(u, v);
        }
      }
    }
  }
  return mask;
}

}  // namespace ipl_slam
