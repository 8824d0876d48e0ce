#include "dataset/synthetic/doors.hpp"

#include <cmath>
#include <numbers>
#include <vector>

#include "dataset/synthetic/paint.hpp"
#include "dataset/synthetic/plain_building.hpp"

namespace ipl_slam::synthetic {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using std::numbers::pi;

constexpr double kPeriod = 3.0;       // metres from door to door
const Vector2d kHalfRing{10.5, 6.0};  // of the corridors' middle line: 7 and 4 periods
constexpr double kHalfWidth = 1.2;
constexpr double kHeight = 2.5;
constexpr double kThickness = 0.1;
constexpr double kDoorWidth = 0.9;
constexpr double kDoorHeight = 2.05;
constexpr double kDoorPlace = 0.9;  // half of the wall that a door takes with its plate
constexpr int kPicture = 1024;      // texels in a period
constexpr double kCrossingReach = 0.85;

CameraSite site() {
  CameraSite site;
  const Vector2d& h = kHalfRing;
  site.eye_height = 1.45;
  site.loop = LoopPath(
      {{-h.x() + kPeriod, -h.y()}, {h.x(), -h.y()}, {h.x(), h.y()}, {-h.x(), h.y()}, {-h.x(), -h.y()}});
  // Before doors: between them things may stand in the way.
  for (const Vector2d& place : std::vector<Vector2d>{{-3, -h.y()},
                                                     {6, -h.y()},
                                                     {h.x(), 1.5},
                                                     {6, h.y()},
                                                     {0, h.y()},
                                                     {-6, h.y()},
                                                     {-h.x(), 1.5},
                                                     {-h.x(), -1.5}}) {
    site.crossings.push_back({site.loop.nearest_time(place), kCrossingReach});
  }
  site.free_min = {-h.x() - 0.5, -h.y() - 0.5, 1.2};
  site.free_max = {h.x() + 0.5, h.y() + 0.5, 1.7};
  return site;
}

class DoorsBuilder {
 public:
  DoorsBuilder(Scene& scene, std::uint64_t seed) : parts_(scene, hash64(seed, 7)) {
    paper_ = builder_.material(paint_wallpaper(kPicture, random_), kPicture / kPeriod);
    wood_ = builder_.material(paint_wood(512, {85, 125, 165}, random_), 400.0);
    panel_ = builder_.material(paint_wood(512, {60, 95, 135}, random_), 400.0);
    frame_ = builder_.material(paint_wood(256, {60, 75, 95}, random_), 300.0);
    metal_ = builder_.material(paint_plain(256, {150, 150, 150}, 14.0F, random_), 300.0);
    dark_ = builder_.material(paint_plain(256, {45, 42, 40}, 14.0F, random_), 300.0);
    plate_ = builder_.material(paint_sheet(64, 64, random_));
    lamp_ = builder_.material(paint_plain(64, {255, 255, 255}, 0.0F, random_), 100.0);
  }

  void build_floor_and_ceiling() {
    const Vector3d size(2 * (kHalfRing.x() + kHalfWidth), 2 * (kHalfRing.y() + kHalfWidth), kThickness);
    const int floor = builder_.material(paint_mosaic(512, 12, random_), 512 / kPeriod);
    const int ceiling = builder_.material(paint_ceiling(512, random_), 512 / kPeriod);
    builder_.structure();
    builder_.at({0, 0, 0});
    builder_.box({0, 0, -kThickness / 2}, size, floor);
    builder_.box({0, 0, kHeight + kThickness / 2}, size, ceiling);
    for (const double side : {-1.0, 1.0}) {
      for (double x = -9.0; x < 10.0; x += kPeriod)
        builder_.box({x, side * kHalfRing.y(), kHeight}, {0.3, 1.2, 0.06}, lamp_);
      for (double y = -4.5; y < 5.0; y += kPeriod)
        builder_.box({side * kHalfRing.x(), y, kHeight}, {1.2, 0.3, 0.06}, lamp_);
    }
  }

  // A wall of whole periods and what it is longer by at its ends, a door in the middle of each period.
  void build_wall(const Vector2d& at, double yaw, int periods, double beyond) {
    builder_.structure();
    parts_.on_wall({at.x(), at.y(), 0}, yaw);
    const double length = periods * kPeriod + 2 * beyond;
    const double phase = periods % 2 ? 0.0 : 0.5 * kPeriod;  // of the picture, at the middle of the wall
    builder_.box({-kThickness / 2, 0, kHeight / 2}, {kThickness, length, kHeight},
                 builder_.shifted(paper_, phase, 0));
    parts_.slab(0, 0, {0.015, length, 0.1}, frame_);
    for (int i = 0; i < periods; ++i) {
      const double along = (i - 0.5 * (periods - 1)) * kPeriod;
      if (std::abs(along) + kDoorPlace < length / 2) add_door(along);  // not round an inner corner
    }
  }

  // Boards, plants and bins, each at some place between two doors.
  void add_differences(const Vector2d& at, double yaw, int periods) {
    for (int i = 0; i + 1 < periods; ++i) {
      if (!random_.chance(kDifferent)) continue;
      parts_.on_wall({at.x(), at.y(), 0}, yaw);
      const double along = (i - 0.5 * periods + 1.0) * kPeriod + random_.uniform(-0.4, 0.4);
      switch (random_.uniform_int(0, 2)) {
        case 0:
          add_board(along);
          break;
        case 1:
          add_plant(along);
          break;
        default:
          add_bin(along);
      }
    }
  }

  // Stains and scraps on the floor.
  void add_dirt() {
    builder_.structure();
    for (int i = 0; i < kStains; ++i) {
      const double x = random_.uniform(-kHalfRing.x(), kHalfRing.x());
      const double y = random_.uniform(-kHalfRing.y(), kHalfRing.y());
      const double off = random_.uniform(-1.0, 1.0);
      const double side = random_.chance(0.5) ? 1.0 : -1.0;
      const bool on_x = random_.chance(kHalfRing.x() / (kHalfRing.x() + kHalfRing.y()));
      const Vector2d at =
          on_x ? Vector2d(x, side * kHalfRing.y() + off) : Vector2d(side * kHalfRing.x() + off, y);
      builder_.at({at.x(), at.y(), 0}, random_.uniform(-pi, pi));
      builder_.box({0, 0, 0}, {random_.uniform(0.04, 0.25), random_.uniform(0.03, 0.12), 0.004},
                   random_.chance(0.3) ? plate_ : dark_);
    }
  }

  [[nodiscard]] SceneBuilder& builder() { return builder_; }

 private:
  static constexpr double kDifferent = 0.35;  // share of the places between doors where something stands
  static constexpr int kStains = 90;

  void add_door(double along) {
    parts_.door(along, kDoorWidth, kDoorHeight, frame_, wood_);
    for (const double z : {0.55, 1.45}) builder_.box({0.02, along, z}, {0.02, 0.6, 0.7}, panel_);
    builder_.box({0.05, along + 0.36, 1.05}, {0.08, 0.03, 0.12}, metal_);
    builder_.box({0.03, along, 0.1}, {0.01, 0.8, 0.16}, metal_);
    builder_.box({0.005, along - 0.75, 1.55}, {0.01, 0.22, 0.16}, dark_).materials[1] = plate_;
    builder_.box({0.01, along - 0.75, 1.1}, {0.02, 0.09, 0.09}, metal_);
  }

  void add_board(double along) {
    builder_.structure();
    const int board = builder_.material(paint_poster(512, 512, random_));
    builder_.box({0.01, along, 1.5}, {0.02, 1.0, 0.8}, dark_).materials[1] = board;
  }

  void add_plant(double along) {
    builder_.object("potted plant");
    const int leaf =
        builder_.material(paint_plain(128, {50, random_.uniform(90, 150), 60}, 40.0F, random_), 300.0);
    builder_.capsule({0.2, along, 0.1}, {0.2, along, 0.25}, 0.13, 0.13, dark_);
    for (int i = 0; i < 9; ++i) {
      const Vector3d tip(0.2 + random_.uniform(-0.12, 0.15), along + random_.uniform(-0.3, 0.3),
                         random_.uniform(0.6, 1.2));
      builder_.capsule({0.2, along, 0.3}, tip, 0.05, 0.02, leaf);
    }
  }

  void add_bin(double along) {
    builder_.object("bin");
    builder_.box({0.16, along, 0.3}, {0.28, 0.32, 0.6}, builder_.material(paint_cardboard(128, random_)));
  }

  PlainBuilding parts_;
  SceneBuilder& builder_ = parts_.builder();
  Random& random_ = parts_.random();
  int paper_, wood_, panel_, frame_, metal_, dark_, plate_, lamp_;
};

}  // namespace

Scene make_doors(const PassersBy& people) {
  Scene scene;
  scene.lamp = {0, 0, 40};  // so high that all places of the ring are lit the same
  scene.site = site();
  DoorsBuilder doors(scene, people.seed);
  doors.build_floor_and_ceiling();
  doors.add_dirt();
  struct Run {
    Vector2d middle, out;
    int periods;
  };
  const Run runs[] = {{{0, -kHalfRing.y()}, {0, -1}, 7},
                      {{kHalfRing.x(), 0}, {1, 0}, 4},
                      {{0, kHalfRing.y()}, {0, 1}, 7},
                      {{-kHalfRing.x(), 0}, {-1, 0}, 4}};
  for (const Run& run : runs) {
    for (const double side : {-1.0, 1.0}) {
      const Vector2d at = run.middle + side * kHalfWidth * run.out;
      const double yaw = std::atan2(-side * run.out.y(), -side * run.out.x());
      doors.build_wall(at, yaw, run.periods, side * kHalfWidth);
      doors.add_differences(at, yaw, run.periods);
    }
  }
  add_passers_by(doors.builder(), scene.site, people);
  return scene;
}

}  // namespace ipl_slam::synthetic
