#include "dataset/synthetic/white_room.hpp"

#include <numbers>

#include "dataset/synthetic/plain_building.hpp"

namespace ipl_slam::synthetic {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

const Vector3d kHalfExtent{3.0, 2.5, 1.3};

CameraSite site() {
  CameraSite site;
  site.look_at = {0, 0, 0.95};
  site.orbit_radii = {2.0, 1.7};
  site.eye_height = 1.45;
  site.station = {-1.9, -1.5, 1.45};
  site.sweep_from = {-2.3, -1.5, 1.4};
  site.sweep_to = {0.3, -1.5, 1.4};
  site.free_min = {-2.6, -2.0, 0.9};
  site.free_max = {2.2, 2.0, 2.2};
  return site;
}

}  // namespace

Scene make_white_room(std::uint64_t seed) {
  Scene scene;
  scene.lamp = {0.7, -0.5, 2.4};
  scene.softness = kSoftness;
  scene.site = site();
  PlainBuilding room(scene, hash64(seed, 4));
  Random& random = room.random();
  room.shell(kHalfExtent, {.floor = 135, .ceiling = 238, .wall_x = 225, .wall_y = 190, .skirting = 150});
  const int white = room.paint(235);
  const int rail = room.paint(160);
  // Each wall's parts; the rail runs along all of it but stops at the door.
  const auto rail_between = [&](double from, double to) {
    room.slab(0.5 * (from + to), 0.78, {0.03, to - from, 0.06}, rail);
  };
  room.on_wall({0, kHalfExtent.y(), 0}, -pi / 2);
  const double door = random.uniform(-0.4, 0.6);
  room.door(door, 0.9, 2.0 * kHalfExtent.z(), white, room.paint(160));
  rail_between(-kHalfExtent.x(), door - 0.52);
  rail_between(door + 0.52, kHalfExtent.x());
  room.on_wall({0, -kHalfExtent.y(), 0}, pi / 2);
  room.slab(random.uniform(-0.5, 0.5), 0.95, {0.03, 2.4, 1.1}, room.paint(230));
  rail_between(-kHalfExtent.x(), kHalfExtent.x());
  room.on_wall({-kHalfExtent.x(), 0, 0}, 0.0);
  room.window(random.uniform(-0.4, 0.4), 1.0, 1.8, 1.1, white, room.paint(180));
  rail_between(-kHalfExtent.y(), kHalfExtent.y());
  room.on_wall({kHalfExtent.x(), 0, 0}, pi);
  room.slab(random.uniform(-0.3, 0.3), 0.0, {0.45, 1.7, 0.9}, room.paint(180));
  room.slab(0, 1.6, {0.2, 2 * kHalfExtent.y(), 0.05}, room.paint(200));  // a shelf from wall to wall
  rail_between(-kHalfExtent.y(), kHalfExtent.y());
  room.builder().at({0, 0, 0}, random.uniform(-0.2, 0.2));
  room.builder().box({0, 0, 0.4}, {1.5, 0.8, 0.8}, room.paint(200));
  return scene;
}

}  // namespace ipl_slam::synthetic
