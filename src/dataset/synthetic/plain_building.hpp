#pragma once

#include <cstdint>

#include "common/random.hpp"
#include "dataset/synthetic/scene_builder.hpp"

namespace ipl_slam::synthetic {

/// Grey values (at full light) of the faces of a space with four walls.
struct ShellPaint {
  double floor = 140, ceiling = 235, wall_x = 205, wall_y = 175, skirting = 110;
};

/// What is plain is seen through a slightly soft lens, as a cheap colour camera has: an outline that is sharp
/// to the pixel breaks into steps, and steps are corners. Pixels, see Scene::softness.
constexpr double kSoftness = 0.8;

/// Parts of a freshly painted, empty building: every surface is of one colour. What there is to see is
/// edges, where surfaces of different shade meet. Parts on a wall are given in the wall's frame: x out of the
/// wall, y along it (to the left of someone who looks at it), z up from the floor.
class PlainBuilding {
 public:
  PlainBuilding(Scene& scene, std::uint64_t seed) : builder_(scene), random_(seed) {}

  /// A material of one colour near to a grey value; each is a little different, in tint too.
  int paint(double grey);
  /// Floor, ceiling and four walls about the origin, and skirting boards along the walls.
  void shell(const Eigen::Vector3d& half_extent, const ShellPaint& paint);
  /// The parts below are put on a wall that passes `at` (its height is the floor's), its x-axis turned by
  /// yaw.
  void on_wall(const Eigen::Vector3d& at, double yaw) { builder_.at(at, yaw); }

  /// A closed door with its frame: a plain leaf.
  void door(double along, double width, double height, int frame, int leaf);
  /// A frame of four bars about a plain pane.
  void window(double along, double sill, double width, double height, int frame, int pane);
  /// A plain slab of this thickness on the wall, or a cabinet before it where it is thick.
  void slab(double along, double bottom, const Eigen::Vector3d& size, int material);

  [[nodiscard]] Random& random() { return random_; }
  [[nodiscard]] SceneBuilder& builder() { return builder_; }

 private:
  void skirting(const Eigen::Vector3d& half_extent, int material);

  SceneBuilder builder_;
  Random random_;
};

}  // namespace ipl_slam::synthetic
