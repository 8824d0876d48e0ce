#include "features/undistortion_table.hpp"

#include <algorithm>
#include <cstddef>

namespace ipl_slam {
namespace {

constexpr int kCell = 8;  // pixels; distortion is quadratic at worst over so short a way

}  // namespace

UndistortionTable::UndistortionTable(const Camera& camera)
    : distorted_(camera.distorted()), columns_(camera.width / kCell + 1), rows_(camera.height / kCell + 1) {
  if (!distorted_) return;
  for (int j = 0; j <= rows_; ++j) {
    for (int i = 0; i <= columns_; ++i) {
      const Eigen::Vector2d pixel(i * kCell, j * kCell);
      shifts_.emplace_back((camera.undistort(pixel) - pixel).cast<float>());
    }
  }
}

Eigen::Vector2f UndistortionTable::operator()(const Eigen::Vector2f& pixel) const {
  if (!distorted_) return pixel;
  const Eigen::Vector2f cells = pixel / kCell;
  const int i = std::clamp(static_cast<int>(cells.x()), 0, columns_ - 1);
  const int j = std::clamp(static_cast<int>(cells.y()), 0, rows_ - 1);
  const float a = cells.x() - static_cast<float>(i), b = cells.y() - static_cast<float>(j);
  const Eigen::Vector2f* upper = shifts_.data() + static_cast<std::ptrdiff_t>(j) * (columns_ + 1) + i;
  const Eigen::Vector2f* lower = upper + columns_ + 1;
  return pixel + (1.0F - b) * ((1.0F - a) * upper[0] + a * upper[1]) +
         b * ((1.0F - a) * lower[0] + a * lower[1]);
}

}  // namespace ipl_slam
