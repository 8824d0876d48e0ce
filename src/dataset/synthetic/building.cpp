#include "dataset/synthetic/building.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>

#include "dataset/synthetic/furniture.hpp"
#include "dataset/synthetic/paint.hpp"

namespace ipl_slam::synthetic {
namespace {

using Eigen::AlignedBox2d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using std::numbers::pi;

const Vector2d kPitch{7.0, 6.5};  // from room to room
constexpr double kHeight = 2.7;
constexpr double kWall = 0.1;  // each of two adjoining rooms has one of its own
constexpr double kDoorWidth = 1.2;
constexpr double kDoorHeight = 2.1;
constexpr double kDoorOffset = 1.2;    // of the doors, and of the loop, from the middle of a room
constexpr double kDoorStraight = 0.9;  // the loop runs straight this far before and behind a door
constexpr double kCrossingReach = 1.3;
constexpr double kPathClearance = 0.75;    // between the loop and furniture
constexpr double kPersonClearance = 0.40;  // between a crossing's way and furniture

// A side of the ring: three rooms in a row, seen from its middle room.
struct Side {
  Vector2d middle, along, out;
  double pitch;  // along it
  [[nodiscard]] Vector2d at(double a, double o) const { return middle + a * along + o * out; }
};

std::array<Side, 4> sides() {
  return {Side{{0, -kPitch.y()}, {1, 0}, {0, -1}, kPitch.x()},
          Side{{kPitch.x(), 0}, {0, 1}, {1, 0}, kPitch.y()},
          Side{{0, kPitch.y()}, {-1, 0}, {0, 1}, kPitch.x()},
          Side{{-kPitch.x(), 0}, {0, -1}, {-1, 0}, kPitch.y()}};
}

std::vector<Vector2d> room_centres() {
  std::vector<Vector2d> centres;
  for (const Side& side : sides()) {
    centres.push_back(side.middle);
    centres.push_back(side.at(side.pitch, 0.0));
  }
  return centres;
}

std::vector<Vector2d> door_places() {
  std::vector<Vector2d> doors;
  for (const Side& side : sides()) {
    for (const double sign : {-1.0, 1.0}) doors.push_back(side.at(sign * side.pitch / 2, kDoorOffset));
  }
  return doors;
}

// Through the doors near the outer walls, and in the middle of each side round what stands there.
LoopPath make_loop() {
  std::vector<Vector2d> corners;
  for (const Side& side : sides()) {
    const double door = side.pitch / 2;
    for (const double a : {-side.pitch, -door - kDoorStraight, -door + kDoorStraight}) {
      corners.push_back(side.at(a, kDoorOffset));
    }
    corners.push_back(side.at(-0.8, -kDoorOffset));
    corners.push_back(side.at(0.8, -kDoorOffset));
    for (const double a : {door - kDoorStraight, door + kDoorStraight, side.pitch}) {
      corners.push_back(side.at(a, kDoorOffset));
    }
  }
  return LoopPath(corners);
}

CameraSite site() {
  CameraSite site;
  site.eye_height = 1.45;
  site.loop = make_loop();
  for (const Side& side : sides()) {
    const Vector2d middle = side.at(0.0, -kDoorOffset);
    const Vector2d corner = side.at(side.pitch + kDoorOffset / 2, kDoorOffset / 2);
    for (const Vector2d& place : {middle, corner}) {
      site.crossings.push_back({site.loop.nearest_time(place), kCrossingReach});
    }
  }
  const Vector2d half = 1.5 * kPitch;
  site.free_min = {-half.x(), -half.y(), 1.2};
  site.free_max = {half.x(), half.y(), 1.7};
  return site;
}

// Floor that is taken, and floor that must stay free.
class FloorPlan {
 public:
  explicit FloorPlan(const CameraSite& site) {
    for (double t = 0.0; t < site.loop.lap_time(); t += 0.1) {
      path_.push_back(site.loop.position(t));
      for (const Crossing& crossing : site.crossings) {
        people_.push_back(crossing_place(site.loop, crossing, t));
      }
    }
  }

  // Takes the floor if nobody else needs it.
  bool take(const AlignedBox2d& area) {
    for (const AlignedBox2d& other : taken_) {
      if (area.intersects(other)) return false;
    }
    for (const Vector2d& p : path_) {
      if (area.exteriorDistance(p) < kPathClearance) return false;
    }
    for (const Vector2d& p : people_) {
      if (area.exteriorDistance(p) < kPersonClearance) return false;
    }
    taken_.push_back(area);
    return true;
  }

 private:
  std::vector<Vector2d> path_, people_;
  std::vector<AlignedBox2d> taken_;
};

// One wall of a room: x out of the wall into the room, y along it, z up, from the middle of its foot.
struct Wall {
  SE3 T_ww;
  double yaw;
  double half_length;
  std::vector<double> doors;  // along it

  [[nodiscard]] Vector3d at(double x, double y, double z = 0.0) const { return T_ww * Vector3d(x, y, z); }
  [[nodiscard]] AlignedBox2d area(double depth, double from, double to) const {
    AlignedBox2d area;
    area.extend(at(0.0, from).head<2>());
    area.extend(at(depth, to).head<2>());
    return area;
  }
  [[nodiscard]] bool meets_door(double from, double to) const {
    constexpr double kTrim = 0.12;
    for (const double door : doors) {
      if (to > door - kDoorWidth / 2 - kTrim && from < door + kDoorWidth / 2 + kTrim) return true;
    }
    return false;
  }
};

std::array<Wall, 4> walls_of(const Vector2d& centre) {
  const Vector2d half = kPitch / 2 - Vector2d::Constant(kWall);
  std::array<Wall, 4> walls;
  for (int k = 0; k < 4; ++k) {
    Wall& wall = walls[k];
    wall.yaw = k * pi / 2;
    const Vector2d inward(std::round(std::cos(wall.yaw)), std::round(std::sin(wall.yaw)));
    const Vector2d foot = centre - inward.cwiseProduct(half);
    wall.T_ww = SE3(Eigen::Quaterniond(Eigen::AngleAxisd(wall.yaw, Vector3d::UnitZ())),
                    Vector3d(foot.x(), foot.y(), 0));
    wall.half_length = k % 2 ? half.x() : half.y();
    for (const Vector2d& door : door_places()) {
      const Vector3d local = wall.T_ww.inverse() * Vector3d(door.x(), door.y(), 0);
      if (std::abs(local.x()) < 2 * kWall && std::abs(local.y()) < wall.half_length) {
        wall.doors.push_back(local.y());
      }
    }
  }
  return walls;
}

class BuildingBuilder {
 public:
  BuildingBuilder(Scene& scene, std::uint64_t seed) : furniture_(scene, hash64(seed, 6)), plan_(scene.site) {
    trim_ = builder_.material(paint_wood(256, {80, 105, 135}, random_), 300.0);
    styles_ = {0, 1, 2, 3, 0, 1, 2, 3};
    random_.shuffle(styles_);
    builder_.structure();
    const int ceiling = builder_.material(paint_ceiling(512, random_), 200.0);
    builder_.box({0, 0, kHeight + kWall / 2}, {3 * kPitch.x(), 3 * kPitch.y(), kWall}, ceiling);
  }

  void add_room(int number, const Vector2d& centre) {
    builder_.structure();
    builder_.at({centre.x(), centre.y(), 0});
    builder_.box({0, 0, -kWall / 2}, {kPitch.x(), kPitch.y(), kWall}, floor_material(styles_[number]));
    const int papers[2] = {wall_material(styles_[7 - number]), plain_material()};
    const std::array<Wall, 4> walls = walls_of(centre);
    for (int k = 0; k < 4; ++k) {
      build_wall(walls[k], builder_.shifted(papers[k % 2], random_.uniform(0, 2), 0));
      hang_pictures(walls[k]);
    }
    furnish_middle(centre);
    desks_left_ = 1;
    for (const Wall& wall : walls) furnish(wall);
  }

  [[nodiscard]] SceneBuilder& builder() { return builder_; }

 private:
  cv::Mat tinted(const cv::Mat& picture) {
    cv::Mat result;
    cv::multiply(
        picture,
        cv::Scalar(random_.uniform(0.7, 1.15), random_.uniform(0.7, 1.15), random_.uniform(0.7, 1.15)),
        result);
    return result;
  }

  int plain_material() {
    const cv::Scalar color(random_.uniform(150, 245), random_.uniform(150, 245), random_.uniform(150, 245));
    return builder_.material(paint_plain(512, color, 26.0F, random_), 256.0);
  }

  int wall_material(int style) {
    if (style == 0) return builder_.material(tinted(paint_bricks(512, random_)), 256.0);
    if (style == 1) return builder_.material(tinted(paint_planks(512, random_)), 300.0);
    return plain_material();
  }

  int floor_material(int style) {
    if (style == 0) return builder_.material(tinted(paint_planks(512, random_)), 256.0);
    if (style == 1) return builder_.material(tinted(paint_mosaic(512, 8, random_)), 200.0);
    if (style == 2) return builder_.material(tinted(paint_wood(512, {90, 120, 150}, random_)), 256.0);
    return builder_.material(
        paint_plain(512, {random_.uniform(60, 150), random_.uniform(60, 150), random_.uniform(60, 150)},
                    40.0F, random_),
        256.0);
  }

  void wall_piece(double from, double to, double bottom, int paper) {
    if (to - from < 1e-6) return;
    builder_.box({-kWall / 2, 0.5 * (from + to), 0.5 * (bottom + kHeight)},
                 {kWall, to - from, kHeight - bottom},
                 builder_.shifted(paper, 0.5 * (from + to), 0.5 * bottom));
  }

  void build_wall(const Wall& wall, int paper) {
    builder_.structure();
    builder_.at(wall.T_ww.translation(), wall.yaw);
    double from = -wall.half_length - kWall;
    for (const double door : wall.doors) {
      wall_piece(from, door - kDoorWidth / 2, 0.0, paper);
      wall_piece(door - kDoorWidth / 2, door + kDoorWidth / 2, kDoorHeight, paper);
      from = door + kDoorWidth / 2;
      for (const double side : {-1.0, 1.0}) {
        builder_.box({0.01, door + side * (kDoorWidth / 2 + 0.04), kDoorHeight / 2},
                     {0.04, 0.08, kDoorHeight}, trim_);
      }
      builder_.box({0.01, door, kDoorHeight + 0.04}, {0.04, kDoorWidth + 0.16, 0.08}, trim_);
    }
    wall_piece(from, wall.half_length + kWall, 0.0, paper);
  }

  void hang_pictures(const Wall& wall) {
    builder_.structure();
    builder_.at(wall.T_ww.translation(), wall.yaw);
    double from = -wall.half_length + random_.uniform(0.2, 0.8);
    while (true) {
      const bool sheet = random_.chance(0.4);
      const double width = sheet ? random_.uniform(0.3, 0.5) : random_.uniform(0.6, 1.2);
      const double height = width * (sheet ? 1.4 : random_.uniform(0.75, 1.3));
      if (from + width > wall.half_length) return;
      if (!wall.meets_door(from, from + width)) {
        const int picture =
            builder_.material(sheet ? paint_sheet(128, 256, random_) : paint_poster(256, 256, random_));
        builder_
            .box({0.003, from + width / 2, random_.uniform(1.6, 1.85)}, {0.006, width, height},
                 furniture_.dark())
            .materials[1] = picture;
      }
      from += width + random_.uniform(0.25, 0.9);
    }
  }

  // A table with two chairs on a rug, wherever there is room.
  void furnish_middle(const Vector2d& centre) {
    constexpr int kTries = 100;
    const Vector2d half(0.75, 1.05);
    for (int i = 0; i < kTries; ++i) {
      const Vector2d at = centre + Vector2d(random_.uniform(-2.5, 2.5), random_.uniform(-2.0, 2.0));
      if (!plan_.take({at - half, at + half})) continue;
      const Vector3d floor(at.x(), at.y(), 0);
      builder_.structure();
      builder_.at(floor);
      const int rug = builder_.material(paint_rug(256, 512, random_));
      builder_.box({0, 0, 0.004}, {1.9, 2.6, 0.008}, furniture_.dark()).materials[5] = rug;
      furniture_.add_table(floor, 0.0, {random_.uniform(1.1, 1.4), 0.8},
                           random_.chance(0.5) ? furniture_.wood() : furniture_.pale_wood());
      for (const double side : {-1.0, 1.0}) {
        const Vector3d chair(random_.uniform(-0.3, 0.3), side * random_.uniform(0.65, 0.9), 0);
        furniture_.add_chair(floor + chair, -side * pi / 2 + random_.uniform(-0.3, 0.3));
      }
      const Vector3d top = floor + Vector3d(0, 0, kTableTop);
      furniture_.add_monitor(top + Vector3d(random_.uniform(-0.3, 0.3), 0.1, 0), random_.uniform(-pi, pi));
      furniture_.add_carton(top + Vector3d(random_.uniform(-0.4, 0.4), -0.22, 0), random_.uniform(-0.5, 0.5),
                            {0.25, 0.2, 0.18});
      return;
    }
  }

  // Piece by piece along a wall.
  void furnish(const Wall& wall) {
    double from = -wall.half_length + random_.uniform(0.05, 0.4);
    while (from < wall.half_length - 0.4) {
      from += place_piece(wall, from) ? random_.uniform(0.05, 0.5) : 0.2;
    }
  }

  // Moves `from` behind the piece if it has room there.
  bool place_piece(const Wall& wall, double& from) {
    struct Piece {
      double width, depth;
    };
    constexpr std::array<Piece, 5> kPieces = {
        Piece{1.54, 0.6}, {1.1, 0.36}, {0.6, 0.5}, {1.2, 0.36}, {0.5, 0.5}};
    std::size_t kind = random_.index(kPieces.size());
    if (kind == 0 && desks_left_ == 0) kind = 1 + random_.index(kPieces.size() - 1);
    const Piece& piece = kPieces[kind];
    const double to = from + piece.width;
    if (to > wall.half_length || wall.meets_door(from, to) || !plan_.take(wall.area(piece.depth, from, to))) {
      return false;
    }
    const Vector3d at = wall.at(0.01 + piece.depth / 2, 0.5 * (from + to));
    if (kind == 0) {
      furniture_.add_desk_along_wall(at, wall.yaw);
      --desks_left_;
    } else if (kind == 1) {
      const int shelves = random_.uniform_int(4, 6);
      furniture_.add_bookshelf(at, wall.yaw, piece.width, 0.35 * shelves, shelves);
    } else if (kind == 2) {
      const int rows = random_.uniform_int(2, 4);
      furniture_.add_cabinet(at, wall.yaw, {0.48, piece.width, 0.32 * rows}, rows);
    } else if (kind == 3) {
      furniture_.add_open_shelf(at, wall.yaw);
    } else {
      furniture_.add_carton(at, wall.yaw, {0.42, 0.44, random_.uniform(0.3, 0.5)});
    }
    from = to;
    return true;
  }

  Furniture furniture_;
  SceneBuilder& builder_ = furniture_.builder();
  Random& random_ = furniture_.random();
  FloorPlan plan_;
  int trim_ = 0;
  int desks_left_ = 0;
  std::vector<int> styles_;
};

}  // namespace

Scene make_building(const PassersBy& people) {
  Scene scene;
  scene.lamp = {60, 35, 90};  // far away: light from above, a little from one side, the same in all rooms
  scene.site = site();
  BuildingBuilder building(scene, people.seed);
  int number = 0;
  for (const Vector2d& centre : room_centres()) building.add_room(number++, centre);
  add_passers_by(building.builder(), scene.site, people);
  return scene;
}

}  // namespace ipl_slam::synthetic
