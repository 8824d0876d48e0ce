#include "dataset/synthetic/room.hpp"

#include <cmath>
#include <numbers>

#include "dataset/synthetic/furniture.hpp"
#include "dataset/synthetic/paint.hpp"
#include "dataset/synthetic/person.hpp"
#include "dataset/synthetic/story.hpp"

namespace ipl_slam::synthetic {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using std::numbers::pi;

const double kX = kRoomHalfExtent.x();
const double kY = kRoomHalfExtent.y();
const double kHeight = 2.0 * kRoomHalfExtent.z();
constexpr double kWall = 0.1;        // thickness
constexpr double kDoorFrom = -1.55;  // of the opening in the wall x = +kX, along y
constexpr double kDoorTo = -0.65;
constexpr double kDoorHeight = 2.05;
constexpr double kSeatRadius = 1.0;
const double kSeatAngles[] = {0.5 * pi + 0.25, -0.5 * pi + 0.35};

// A box that is pushed about: follows a slow figure and rests between pushes.
class PushedBox : public Motion {
 public:
  PushedBox(const Vector3d& centre, const Vector2d& reach, Random& random)
      : centre_(centre), reach_(reach), start_(random.uniform(0.0, 6.0)), turn_(random.uniform(-0.5, 0.5)) {}

  [[nodiscard]] int frame_count() const override { return 1; }
  void append_frames(double time, std::vector<SE3>& frames) const override {
    // Time that runs on for 3 s and stands still for 2 s, with smooth starts and stops.
    constexpr double kCycle = 5.0;
    constexpr double kMoving = 3.0;
    const double t = time + start_;
    const double cycles = std::floor(t / kCycle);
    const double x = std::min(1.0, (t - cycles * kCycle) / kMoving);
    const double progress = cycles + x * x * (3.0 - 2.0 * x);
    const Vector3d at =
        centre_ + Vector3d(reach_.x() * std::sin(1.9 * progress), reach_.y() * std::cos(2.7 * progress), 0);
    frames.emplace_back(Eigen::Quaterniond(Eigen::AngleAxisd(turn_ + 0.5 * progress, Vector3d::UnitZ())), at);
  }

 private:
  Vector3d centre_;
  Vector2d reach_;
  double start_, turn_;
};

// A door leaf that swings about its hinge, never quite closed.
class SwingingDoor : public Motion {
 public:
  SwingingDoor(const Vector3d& hinge, double rest) : hinge_(hinge), rest_(rest) {}
  [[nodiscard]] int frame_count() const override { return 1; }
  void append_frames(double time, std::vector<SE3>& frames) const override {
    const double angle = rest_ + 0.45 * std::sin(1.1 * time);
    frames.emplace_back(Eigen::Quaterniond(Eigen::AngleAxisd(angle, Vector3d::UnitZ())), hinge_);
  }

 private:
  Vector3d hinge_;
  double rest_;
};

class RoomBuilder {
 public:
  RoomBuilder(Scene& scene, std::uint64_t seed) : scene_(scene), furniture_(scene, hash64(seed, 1)) {}

  void build_shell() {
    builder_.structure();
    builder_.at({0, 0, 0});
    const int bricks = builder_.material(paint_bricks(1024, random_), 400.0);
    const int planks = builder_.material(paint_planks(1024, random_), 400.0);
    const int ceiling = builder_.material(paint_ceiling(512, random_), 200.0);
    const int green = builder_.material(paint_plain(1024, {165, 190, 175}, 24.0F, random_), 300.0);
    const int cream = builder_.material(paint_plain(1024, {180, 205, 215}, 22.0F, random_), 300.0);
    const int blue = builder_.material(paint_plain(1024, {190, 165, 140}, 24.0F, random_), 300.0);
    builder_.box({0.5, 0, -kWall / 2}, {2 * kX + 3, 2 * kY + 2, kWall}, planks);
    builder_.box({0.5, 0, kHeight + kWall / 2}, {2 * kX + 3, 2 * kY + 2, kWall}, ceiling);
    builder_.box({-kX - kWall / 2, 0, kHeight / 2}, {kWall, 2 * kY, kHeight}, bricks);
    builder_.box({0, kY + kWall / 2, kHeight / 2}, {2 * kX + 0.2, kWall, kHeight}, cream);
    builder_.box({0, -kY - kWall / 2, kHeight / 2}, {2 * kX + 0.2, kWall, kHeight}, green);
    // The wall with the door, and a piece of corridor behind it.
    const double x = kX + kWall / 2;
    builder_.box({x, 0.5 * (kDoorTo + kY), kHeight / 2}, {kWall, kY - kDoorTo, kHeight}, blue);
    builder_.box({x, 0.5 * (kDoorFrom - kY), kHeight / 2}, {kWall, kY + kDoorFrom, kHeight},
                 builder_.shifted(blue, 1.3, 0.7));
    builder_.box({x, 0.5 * (kDoorFrom + kDoorTo), 0.5 * (kDoorHeight + kHeight)},
                 {kWall, kDoorTo - kDoorFrom, kHeight - kDoorHeight}, builder_.shifted(blue, 2.1, 0.2));
    builder_.box({kX + 1.45, 0, kHeight / 2}, {kWall, 2 * kY + 1, kHeight},
                 builder_.shifted(green, 0.6, 0.4));
    const int rug = builder_.material(paint_rug(1024, 512, random_));
    builder_.box({0, 0, 0.004}, {3.4, 2.4, 0.008}, furniture_.dark()).materials[5] = rug;
    const int trim = builder_.material(paint_wood(256, {60, 80, 105}, random_), 300.0);
    builder_.box({0, kY - 0.01, 0.05}, {2 * kX, 0.02, 0.1}, trim);
    builder_.box({0, -kY + 0.01, 0.05}, {2 * kX, 0.02, 0.1}, trim);
    builder_.box({-kX + 0.01, 0, 0.05}, {0.02, 2 * kY, 0.1}, trim);
    for (const double y : {kDoorFrom - 0.04, kDoorTo + 0.04}) {
      builder_.box({kX - 0.01, y, kDoorHeight / 2}, {0.04, 0.08, kDoorHeight}, trim);
    }
    builder_.box({kX - 0.01, 0.5 * (kDoorFrom + kDoorTo), kDoorHeight + 0.04},
                 {0.04, kDoorTo - kDoorFrom + 0.16, 0.08}, trim);
  }

  // Posters, sheets and a whiteboard, each with its own picture, hung on the four walls.
  void hang_pictures() {
    builder_.structure();
    struct Place {
      int wall;  // 0: +y, 1: -y, 2: -x, 3: +x
      double along, height, width, tall;
      bool sheet;
    };
    const Place places[] = {
        {0, -2.3, 1.75, 0.8, 1.1, false}, {0, -1.2, 1.65, 0.42, 0.6, true}, {0, -0.6, 1.75, 0.42, 0.6, true},
        {0, 0.45, 1.75, 1.2, 0.9, false}, {0, 1.5, 1.6, 0.5, 0.7, true},    {1, -1.9, 1.7, 0.75, 1.05, false},
        {1, -0.9, 1.7, 0.5, 0.7, true},   {1, 0.1, 1.75, 1.1, 0.85, false}, {1, 1.1, 1.65, 0.5, 0.7, true},
        {2, -1.9, 1.65, 0.7, 1.0, false}, {2, 0.2, 1.85, 1.3, 0.8, false},  {2, 1.35, 1.75, 0.42, 0.6, true},
        {3, -2.3, 1.6, 0.6, 0.85, false}, {3, 0.0, 1.65, 0.7, 1.0, false},  {3, 0.75, 1.6, 0.42, 0.6, true},
        {1, -2.75, 1.5, 0.42, 0.6, true}, {0, -2.95, 1.4, 0.3, 0.42, true}, {3, -2.75, 1.4, 0.3, 0.42, true}};
    for (const Place& place : places) {
      const int picture =
          builder_.material(place.sheet ? paint_sheet(256, 512, random_) : paint_poster(512, 512, random_));
      const bool on_y = place.wall < 2;
      const double sign = place.wall == 0 || place.wall == 3 ? 1.0 : -1.0;
      const double off = sign * ((on_y ? kY : kX) - 0.003);
      const Vector3d centre =
          on_y ? Vector3d(place.along, off, place.height) : Vector3d(off, place.along, place.height);
      const Vector3d size =
          on_y ? Vector3d(place.width, 0.006, place.tall) : Vector3d(0.006, place.width, place.tall);
      builder_.at({0, 0, 0});
      Primitive& p = builder_.box(centre, size, furniture_.dark());
      p.materials[(on_y ? 2 : 0) + (sign > 0 ? 0 : 1)] = picture;
    }
  }

  void furnish() {
    furniture_.add_table({0, 0, 0}, 0.0, {1.4, 0.8}, furniture_.wood());
    for (const double angle : kSeatAngles) {
      furniture_.add_chair({kSeatRadius * std::cos(angle), kSeatRadius * std::sin(angle), 0}, angle);
    }
    furniture_.add_monitor({0.50, 0.14, kTableTop}, 0.2);
    furniture_.add_keyboard({-0.35, -0.22, kTableTop}, 1.7);
    furniture_.add_book({-0.48, 0.2, kTableTop}, 0.4);
    furniture_.add_book({-0.47, 0.21, kTableTop + 0.03}, 0.9);
    furniture_.add_cup({0.15, -0.28, kTableTop});
    furniture_.add_cup({-0.12, 0.3, kTableTop});
    furniture_.add_carton({0.58, -0.22, kTableTop}, 0.5, {0.16, 0.22, 0.14});
    // Along the walls; +x of a piece points into the room.
    furniture_.add_desk_along_wall({-1.9, kY - 0.29, 0}, -pi / 2);
    furniture_.add_bookshelf({2.85, kY - 0.17, 0}, -pi / 2, 1.1, 2.1, 6);
    furniture_.add_cabinet({2.0, kY - 0.25, 0}, -pi / 2, {0.45, 0.45, 1.2}, 4);
    furniture_.add_open_shelf({0.3, kY - 0.17, 0}, -pi / 2);
    furniture_.add_desk_along_wall({0.5, -kY + 0.29, 0}, pi / 2);
    furniture_.add_bookshelf({2.7, -kY + 0.17, 0}, pi / 2, 1.2, 1.8, 5);
    furniture_.add_cabinet({-1.0, -kY + 0.25, 0}, pi / 2, {0.45, 0.5, 1.1}, 3);
    furniture_.add_cabinet({-1.55, -kY + 0.25, 0}, pi / 2, {0.45, 0.5, 0.75}, 2);
    furniture_.add_open_shelf({-kX + 0.17, 0.3, 0}, 0.0);
    furniture_.add_bookshelf({-kX + 0.17, 2.1, 0}, 0.0, 1.0, 1.9, 5);
    furniture_.add_cabinet({-kX + 0.25, -0.9, 0}, 0.0, {0.45, 0.6, 1.3}, 4);
    furniture_.add_cabinet({kX - 0.25, 0.6, 0}, pi, {0.45, 0.9, 0.9}, 2);
    furniture_.add_carton({kX - 0.3, 0.5, 0.9}, 0.3, {0.3, 0.35, 0.25});
    furniture_.add_carton({kX - 0.4, 1.6, 0}, 0.2, {0.45, 0.5, 0.4});
    furniture_.add_carton({kX - 0.42, 1.62, 0.4}, -0.2, {0.35, 0.4, 0.3});
    furniture_.add_carton({-kX + 0.3, 1.25, 0}, 0.15, {0.35, 0.45, 0.35});
  }

  void add_door_leaf() {
    const int panel = builder_.material(paint_drawers(256, 512, 3, random_));
    builder_.box({0, -0.44, 0.5 * kDoorHeight}, {0.04, 0.86, kDoorHeight - 0.03}, furniture_.pale_wood());
    Primitive& leaf = scene_.primitives.back();
    leaf.materials[0] = leaf.materials[1] = panel;
  }

  void add_door(bool swings) {
    const Vector3d hinge(kX + kWall, kDoorTo, 0);
    constexpr double kOpen = 1.35;  // radians
    builder_.structure();
    builder_.at(hinge, kOpen);
    if (swings) {
      builder_.object("door");
      builder_.on_frame(builder_.motion(std::make_unique<SwingingDoor>(hinge, kOpen)));
    }
    add_door_leaf();
  }

  void add_pushed_box(int number) {
    const Vector3d places[] = {
        {0.0, 0.02, kTableTop}, {2.0, -1.85, 0.0}, {-1.9, 1.75, 0.0}, {2.0, 1.75, 0.0}};
    const int place = number % 4;
    const Vector3d size = place == 0 ? Vector3d(0.24, 0.18, 0.2) : Vector3d(0.42, 0.34, 0.36);
    const Vector2d reach = place == 0 ? Vector2d(0.22, 0.10) : Vector2d(0.3, 0.12);
    Vector3d centre = places[place];
    centre.z() += number / 4 * size.z();  // more boxes than places are stacked
    builder_.object("box");
    builder_.on_frame(builder_.motion(std::make_unique<PushedBox>(centre, reach, random_)));
    furniture_.carton(size);
  }

  // As big as a refrigerator's.
  void add_late_box(double duration) {
    builder_.object("box");
    builder_.on_frame(builder_.motion(make_late_push(Stage(scene_.site), duration)));
    furniture_.carton({0.5, 0.7, 1.3});
  }

  void add_boxes(const RoomContents& contents) {
    const bool late = contents.story == "push";
    if (late) add_late_box(contents.duration);
    add_door(contents.boxes >= 2);
    for (int i = late ? 1 : 0, pushed = 0; i < contents.boxes; ++i) {
      if (i != 1) add_pushed_box(pushed++);
    }
  }

  void add_cast(const RoomContents& contents) {
    const Stage stage(scene_.site);
    for (int i = 0; i < contents.people; ++i) {
      Random random(hash64(hash64(contents.seed, 2), i));
      const double body_height = random.uniform(1.62, 1.86);
      const Role role = make_role(contents.story, stage, i, contents.people, contents.duration, random);
      builder_.object("person");
      const int first = builder_.motion(std::make_unique<PersonMotion>(role, body_height, contents.duration));
      add_body(builder_, first, body_height, contents.clothes, random);
    }
  }

  void add_people(const RoomContents& contents) {
    WalkingSpace space;
    space.ring_radius = 1.55;
    space.way_out = {{kX - 0.6, 0.5 * (kDoorFrom + kDoorTo)},
                     {kX + 0.75, 0.5 * (kDoorFrom + kDoorTo)},
                     {kX + 0.75, kDoorFrom - 1.0}};
    std::vector<const PersonMotion*> others;
    for (int i = 0; i < contents.people; ++i) {
      Random random(hash64(hash64(contents.seed, 2), i));
      const auto occupied = [&](const Vector2d& p, double t) {
        if (contents.camera_position && (contents.camera_position(t).head<2>() - p).norm() < 0.6) return true;
        for (const PersonMotion* other : others) {
          if ((other->state(t).position - p).norm() < 0.6) return true;
        }
        return false;
      };
      const double body_height = random.uniform(1.62, 1.86);
      std::optional<Seat> seat;
      if (i < 2) {
        seat = Seat{kSeatRadius * Vector2d(std::cos(kSeatAngles[i]), std::sin(kSeatAngles[i]))};
      }
      const double start = 0.9 + 2.0 * pi * i / std::max(1, contents.people) + random.uniform(0.0, 0.6);
      builder_.object("person");
      auto motion = std::make_unique<PersonMotion>(space, seat, start, body_height, contents.duration,
                                                   occupied, random);
      others.push_back(motion.get());
      const int first = builder_.motion(std::move(motion));
      add_body(builder_, first, body_height, contents.clothes, random);
    }
  }

 private:
  Scene& scene_;
  Furniture furniture_;
  SceneBuilder& builder_ = furniture_.builder();
  Random& random_ = furniture_.random();
};

}  // namespace

CameraSite room_camera_site() {
  CameraSite site;
  site.look_at = {0, 0, 0.85};
  site.orbit_radii = {2.3, 2.15};
  site.eye_height = 1.45;
  site.station = {-2.1, -1.9, 1.5};
  site.sweep_from = {-2.1, -2.1, 1.45};
  site.sweep_to = {1.9, -2.1, 1.45};
  site.free_min = {-2.75, -2.4, 1.0};
  site.free_max = {2.75, 2.4, 2.2};
  return site;
}

Scene make_room(const RoomContents& contents) {
  Scene scene;
  scene.lamp = {0.6, 0.4, 2.6};
  scene.site = room_camera_site();
  RoomBuilder room(scene, contents.seed);
  room.build_shell();
  room.hang_pictures();
  room.furnish();
  room.add_boxes(contents);
  if (has_roles(contents.story)) {
    room.add_cast(contents);
  } else {
    room.add_people(contents);
  }
  return scene;
}

}  // namespace ipl_slam::synthetic
