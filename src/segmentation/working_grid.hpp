#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "dataset/rgbd_frame.hpp"
#include "geometry/camera.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {

/// A frame reduced to the working grid.
struct GridFrame {
  cv::Mat inverse_depth;  ///< CV_32FC1, 1/m, 0 = no depth
  cv::Mat grey;           ///< CV_8UC1
};

/// A coarse grid of cells laid over the image as it comes (distorted), with everything about the camera that
/// can be computed once: the viewing ray of each cell, and the cell of each viewing ray. Cells are numbered
/// row by row.
class WorkingGrid {
 public:
  /// At most `width` cells per row, as near to square as the image allows; never finer than the image.
  WorkingGrid(const Camera& camera, int width);

  [[nodiscard]] cv::Size size() const { return size_; }
  [[nodiscard]] cv::Size image_size() const { return image_size_; }
  /// x/z and y/z of the middle of each cell, distortion removed.
  [[nodiscard]] const std::vector<float>& ray_x() const { return ray_x_; }
  [[nodiscard]] const std::vector<float>& ray_y() const { return ray_y_; }

  /// The cell in which a point with these x/z and y/z is seen, -1 outside the image.
  [[nodiscard]] int cell_of_ray(float x, float y) const {
    const float column = (x - first_x_) * entries_per_unit_;
    const float row = (y - first_y_) * entries_per_unit_;
    // Written so that numbers which are not finite end outside.
    if (!(column >= 0.0F && row >= 0.0F && column < static_cast<float>(table_.cols) &&
          row < static_cast<float>(table_.rows))) {
      return -1;
    }
    return table_.ptr<int>(static_cast<int>(row))[static_cast<int>(column)];
  }

  /// Cells per unit of x/z: a length l at depth z spans l/z times as many cells.
  [[nodiscard]] float focal_length() const { return focal_length_; }

  /// First image column (row) of a grid column (row); that of the number of columns is the image's width.
  [[nodiscard]] int image_x(int grid_x) const { return grid_x * image_size_.width / size_.width; }
  [[nodiscard]] int image_y(int grid_y) const { return grid_y * image_size_.height / size_.height; }

  /// Inverse of a raw depth value, 1/m; 0 for 0.
  [[nodiscard]] float inverse_of_raw(std::uint16_t raw) const { return inverse_of_raw_[raw]; }

  /// Averages a frame over each cell. Where a cell holds an edge of depth, the side with more pixels counts:
  /// a mean of both would be a surface that does not exist.
  [[nodiscard]] GridFrame reduce(const cv::Mat& grey, const cv::Mat& depth) const;

 private:
  void fill_table(const Camera& camera);

  cv::Size size_, image_size_;
  std::vector<float> ray_x_, ray_y_;
  cv::Mat table_;  // CV_32SC1: the cell of a ray, entries_per_unit_ entries per unit of x/z and y/z
  float focal_length_ = 1.0F;
  float first_x_ = 0.0F, first_y_ = 0.0F, entries_per_unit_ = 1.0F;
  std::vector<float> inverse_of_raw_;  // 1/m of each raw depth value; 0 for 0
};

/// A point divided by some depth.
struct GridPoint {
  float x, y, z;
};

/// T_ab in single precision, for loops over cells.
class GridTransform {
 public:
  explicit GridTransform(const SE3& T_ab);

  /// The point in frame a, divided by its depth in frame b, where it is seen on this ray at this inverse
  /// depth (0: infinitely far). The third component is the ratio of the depths.
  [[nodiscard]] GridPoint apply(float ray_x, float ray_y, float inverse_depth) const {
    return {r_[0][0] * ray_x + r_[0][1] * ray_y + r_[0][2] + inverse_depth * t_[0],
            r_[1][0] * ray_x + r_[1][1] * ray_y + r_[1][2] + inverse_depth * t_[1],
            r_[2][0] * ray_x + r_[2][1] * ray_y + r_[2][2] + inverse_depth * t_[2]};
  }

 private:
  float r_[3][3];
  float t_[3];
};

}  // namespace ipl_slam
