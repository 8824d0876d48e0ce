#include "dataset/synthetic/corridor.hpp"

#include <numbers>

#include "dataset/synthetic/plain_building.hpp"

namespace ipl_slam::synthetic {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

const Vector3d kHalfExtent{10.0, 1.1, 1.25};
constexpr double kDoorWidth = 0.9;
constexpr double kDoorHeight = 2.05;

CameraSite site() {
  CameraSite site;
  site.look_at = {-3.5, 0, 1.2};
  site.eye_height = 1.45;
  site.station = {-6.0, -0.2, 1.45};
  site.sweep_from = {-9.0, 0, 1.45};
  site.sweep_to = {8.0, 0, 1.45};
  site.free_min = {-9.4, -0.65, 0.9};
  site.free_max = {8.4, 0.65, 2.1};
  return site;
}

}  // namespace

Scene make_corridor(std::uint64_t seed) {
  Scene scene;
  scene.lamp = {1.5, 0.15, 2.3};
  scene.softness = kSoftness;
  scene.site = site();
  PlainBuilding corridor(scene, hash64(seed, 5));
  Random& random = corridor.random();
  corridor.shell(kHalfExtent, {.floor = 135, .ceiling = 238, .wall_x = 215, .wall_y = 195, .skirting = 145});
  const int frame = corridor.paint(222);
  const int leaf = corridor.paint(165);
  for (const double side : {-1.0, 1.0}) {
    corridor.on_wall({0, side * kHalfExtent.y(), 0}, -side * pi / 2);
    for (double along = -7.5 + random.uniform(0.0, 3.0); along < 8.5; along += random.uniform(5.0, 6.5)) {
      corridor.door(along, kDoorWidth, 2.0 * kHalfExtent.z(), frame, leaf);
    }
  }
  corridor.on_wall({kHalfExtent.x(), 0, 0}, pi);
  corridor.door(0, 1.2, kDoorHeight, frame, leaf);
  corridor.on_wall({-kHalfExtent.x(), 0, 0}, 0.0);
  corridor.window(0, 0.9, 1.2, 1.1, frame, corridor.paint(190));
  const int beam = corridor.paint(205);
  corridor.builder().at({0, 0, 0});
  for (double x = -6.0 + random.uniform(-0.5, 0.5); x < 9.0; x += 6.5) {
    corridor.builder().box({x, 0, 2 * kHalfExtent.z() - 0.1}, {0.3, 2 * kHalfExtent.y(), 0.2}, beam);
  }
  return scene;
}

}  // namespace ipl_slam::synthetic
