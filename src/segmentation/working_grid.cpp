#include "segmentation/working_grid.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include <opencv2/imgproc.hpp>

namespace ipl_slam {

namespace {

// The table of rays is finer than the grid, so that its rounding moves no point by more than half a cell.
constexpr float kTableEntriesPerCell = 2.0F;

// Share of a cell's pixels that must have depth.
constexpr float kMinValidShare = 0.3F;

// Inverse depths inside a cell that spread further than this stand on two surfaces, 1/m.
constexpr float kEdgeInsideCell = 0.03F;

struct CellSum {
  int count = 0;
  float sum = 0.0F;
  void add(float value) { ++count, sum += value; }
};

}  // namespace

WorkingGrid::WorkingGrid(const Camera& camera, int width) : image_size_(camera.width, camera.height) {
  size_.width = std::min(width, camera.width);
  size_.height = std::clamp(
      static_cast<int>(std::lround(static_cast<double>(size_.width) * camera.height / camera.width)), 1,
      camera.height);
  for (int y = 0; y < size_.height; ++y) {
    for (int x = 0; x < size_.width; ++x) {
      const Eigen::Vector2d middle{(image_x(x) + image_x(x + 1) - 1) / 2.0,
                                   (image_y(y) + image_y(y + 1) - 1) / 2.0};
      const Eigen::Vector3d ray = camera.unproject(camera.undistort(middle), 1.0);
      ray_x_.push_back(static_cast<float>(ray.x()));
      ray_y_.push_back(static_cast<float>(ray.y()));
    }
  }
  focal_length_ =
      static_cast<float>(camera.fx) * static_cast<float>(size_.width) / static_cast<float>(camera.width);
  fill_table(camera);
  inverse_of_raw_.resize(std::numeric_limits<std::uint16_t>::max() + 1);
  for (std::size_t raw = 1; raw < inverse_of_raw_.size(); ++raw) {
    inverse_of_raw_[raw] = static_cast<float>(camera.depth_scale / static_cast<double>(raw));
  }
}

void WorkingGrid::fill_table(const Camera& camera) {
  const auto [low_x, high_x] = std::minmax_element(ray_x_.begin(), ray_x_.end());
  const auto [low_y, high_y] = std::minmax_element(ray_y_.begin(), ray_y_.end());
  const float cell = 1.0F / focal_length_;
  entries_per_unit_ = kTableEntriesPerCell / cell;
  first_x_ = *low_x - cell / 2;
  first_y_ = *low_y - cell / 2;
  table_.create(static_cast<int>((*high_y - *low_y + cell) * entries_per_unit_) + 1,
                static_cast<int>((*high_x - *low_x + cell) * entries_per_unit_) + 1, CV_32SC1);
  for (int row = 0; row < table_.rows; ++row) {
    for (int column = 0; column < table_.cols; ++column) {
      const Eigen::Vector3d ray{first_x_ + (static_cast<float>(column) + 0.5F) / entries_per_unit_,
                                first_y_ + (static_cast<float>(row) + 0.5F) / entries_per_unit_, 1.0};
      const Eigen::Vector2d pixel = camera.distort(camera.project(ray));
      const int x = static_cast<int>(std::floor((pixel.x() + 0.5) * size_.width / image_size_.width));
      const int y = static_cast<int>(std::floor((pixel.y() + 0.5) * size_.height / image_size_.height));
      const bool inside = x >= 0 && y >= 0 && x < size_.width && y < size_.height;
      table_.at<int>(row, column) = inside ? y * size_.width + x : -1;
    }
  }
}

GridFrame WorkingGrid::reduce(const cv::Mat& grey, const cv::Mat& depth) const {
  GridFrame frame;
  cv::resize(grey, frame.grey, size_, 0, 0, cv::INTER_AREA);
  frame.inverse_depth = cv::Mat::zeros(size_, CV_32FC1);
  for (int y = 0; y < size_.height; ++y) {
    auto* out = frame.inverse_depth.ptr<float>(y);
    for (int x = 0; x < size_.width; ++x) {
      const int x0 = image_x(x), x1 = image_x(x + 1), y0 = image_y(y), y1 = image_y(y + 1);
      CellSum all;
      float low = std::numeric_limits<float>::max(), high = 0.0F;
      for (int j = y0; j < y1; ++j) {
        const auto* row = depth.ptr<std::uint16_t>(j);
        for (int i = x0; i < x1; ++i) {
          if (row[i] == 0) continue;
          const float inverse = inverse_of_raw_[row[i]];
          all.add(inverse);
          low = std::min(low, inverse);
          high = std::max(high, inverse);
        }
      }
      if (static_cast<float>(all.count) < kMinValidShare * static_cast<float>((x1 - x0) * (y1 - y0)) ||
          all.count == 0) {
        continue;
      }
      if (high - low < kEdgeInsideCell) {
        out[x] = all.sum / static_cast<float>(all.count);
        continue;
      }
      const float middle = (low + high) / 2;
      CellSum near, far;
      for (int j = y0; j < y1; ++j) {
        const auto* row = depth.ptr<std::uint16_t>(j);
        for (int i = x0; i < x1; ++i) {
          if (row[i] == 0) continue;
          const float inverse = inverse_of_raw_[row[i]];
          (inverse > middle ? near : far).add(inverse);
        }
      }
      const CellSum& side = near.count >= far.count ? near : far;
      out[x] = side.sum / static_cast<float>(side.count);
    }
  }
  return frame;
}

GridTransform::GridTransform(const SE3& T_ab) {
  const Eigen::Matrix3d rotation = T_ab.rotation_matrix();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) r_[i][j] = static_cast<float>(rotation(i, j));
    t_[i] = static_cast<float>(T_ab.translation()[i]);
  }
}

}  // namespace ipl_slam
