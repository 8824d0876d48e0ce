#include "dataset/synthetic/plain_building.hpp"

#include "dataset/synthetic/paint.hpp"

namespace ipl_slam::synthetic {
namespace {

using Eigen::Vector3d;

constexpr double kThickness = 0.1;  // of walls, floor and ceiling
constexpr double kSkirtingHeight = 0.09;
constexpr double kSkirtingDepth = 0.015;
constexpr double kFrameWidth = 0.07;  // of door and window frames, and how far they stand out
constexpr double kFrameDepth = 0.04;
constexpr double kLeafDepth = 0.015;

}  // namespace

int PlainBuilding::paint(double grey) {
  const double shade = grey + random_.uniform(-4.0, 4.0);
  const double warmth = random_.uniform(-4.0, 4.0);
  return builder_.material(paint_plain(16, {shade - warmth, shade, shade + warmth}, 0.0F, random_), 100.0);
}

void PlainBuilding::shell(const Vector3d& half_extent, const ShellPaint& paint_of) {
  const Vector3d& h = half_extent;
  const double height = 2.0 * h.z();
  builder_.structure();
  builder_.at({0, 0, 0});
  builder_.box({0, 0, -kThickness / 2}, {2 * h.x() + 1, 2 * h.y() + 1, kThickness}, paint(paint_of.floor));
  builder_.box({0, 0, height + kThickness / 2}, {2 * h.x() + 1, 2 * h.y() + 1, kThickness},
               paint(paint_of.ceiling));
  for (const double side : {-1.0, 1.0}) {
    builder_.box({side * (h.x() + kThickness / 2), 0, h.z()}, {kThickness, 2 * h.y(), height},
                 paint(paint_of.wall_x));
    builder_.box({0, side * (h.y() + kThickness / 2), h.z()}, {2 * (h.x() + kThickness), kThickness, height},
                 paint(paint_of.wall_y));
  }
  skirting(h, paint(paint_of.skirting));
}

void PlainBuilding::skirting(const Vector3d& h, int material) {
  const double z = kSkirtingHeight / 2;
  for (const double side : {-1.0, 1.0}) {
    builder_.box({side * (h.x() - kSkirtingDepth / 2), 0, z}, {kSkirtingDepth, 2 * h.y(), kSkirtingHeight},
                 material);
    builder_.box({0, side * (h.y() - kSkirtingDepth / 2), z}, {2 * h.x(), kSkirtingDepth, kSkirtingHeight},
                 material);
  }
}

void PlainBuilding::door(double along, double width, double height, int frame, int leaf) {
  builder_.box({kLeafDepth / 2, along, height / 2}, {kLeafDepth, width, height}, leaf);
  for (const double side : {-1.0, 1.0}) {
    builder_.box({kFrameDepth / 2, along + side * (width + kFrameWidth) / 2, height / 2},
                 {kFrameDepth, kFrameWidth, height}, frame);
  }
  builder_.box({kFrameDepth / 2, along, height + kFrameWidth / 2},
               {kFrameDepth, width + 2 * kFrameWidth, kFrameWidth}, frame);
}

void PlainBuilding::window(double along, double sill, double width, double height, int frame, int pane) {
  builder_.box({kLeafDepth / 2, along, sill + height / 2}, {kLeafDepth, width, height}, pane);
  for (const double side : {-1.0, 1.0}) {
    builder_.box({kFrameDepth / 2, along + side * (width + kFrameWidth) / 2, sill + height / 2},
                 {kFrameDepth, kFrameWidth, height}, frame);
    builder_.box({kFrameDepth / 2, along, sill + height / 2 + side * (height + kFrameWidth) / 2},
                 {kFrameDepth, width + 2 * kFrameWidth, kFrameWidth}, frame);
  }
}

void PlainBuilding::slab(double along, double bottom, const Vector3d& size, int material) {
  builder_.box({size.x() / 2, along, bottom + size.z() / 2}, size, material);
}

}  // namespace ipl_slam::synthetic
