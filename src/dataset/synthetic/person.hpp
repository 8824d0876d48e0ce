#pragma once

#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "common/random.hpp"
#include "dataset/synthetic/scene_builder.hpp"

namespace ipl_slam::synthetic {

/// Where people can be in a scene: a ring they walk along, a seat, and a way out.
struct WalkingSpace {
  Eigen::Vector2d centre{0, 0};
  double ring_radius = 1.5;              ///< metres
  std::vector<Eigen::Vector2d> way_out;  ///< points from the ring to where nobody sees them
};

/// Someone's seat: its place on the floor, reached from the ring straight inwards; the sitter looks outwards.
struct Seat {
  Eigen::Vector2d position;
};

/// A part that is played without chance: wait, walk the way at this speed, stand at its end.
struct Role {
  Eigen::Vector2d start{0, 0};
  double heading = 0.0;  ///< at the start, radians
  double wait = 0.0;     ///< seconds before setting out
  double speed = 0.9;    ///< metres per second
  std::vector<Eigen::Vector2d> way = {};
};

/// What people wear: cloth of one colour, or checks with prints on shirt and trousers, full of corners.
enum class Clothes { Plain, Printed };

/// State of a person at one moment.
struct PersonState {
  Eigen::Vector2d position{0, 0};  ///< of the pelvis over the floor, metres
  double heading = 0.0;            ///< radians, continuous
  double phase = 0.0;              ///< of the walk cycle, radians
  double stride = 0.0;             ///< 0 standing .. 1 walking
  double sitting = 0.0;            ///< 0 upright .. 1 on the seat
};

/// A walking figure. Without a role it walks the ring, stops for a while, sits down and gets up, leaves the
/// room and comes back, as the random generator decides, and waits for others. The story is worked out once,
/// for `duration` seconds.
class PersonMotion : public Motion {
 public:
  enum Part {
    Pelvis,
    Chest,
    Head,
    LeftArm,
    LeftForearm,
    RightArm,
    RightForearm,
    LeftThigh,
    LeftShin,
    LeftFoot,
    RightThigh,
    RightShin,
    RightFoot,
    kParts
  };

  /// occupied(p, t): whether something else needs the floor at p at time t.
  using Occupied = std::function<bool(const Eigen::Vector2d& p, double t)>;

  PersonMotion(const WalkingSpace& space, std::optional<Seat> seat, double start_angle, double body_height,
               double duration, const Occupied& occupied, Random random);
  /// Plays a part; who writes the parts sees to it that nobody is in the way.
  PersonMotion(const Role& role, double body_height, double duration);
  /// Follows course(t), a smooth way over the floor (metres), looking where it goes.
  PersonMotion(const std::function<Eigen::Vector2d(double t)>& course, double body_height, double duration);

  [[nodiscard]] int frame_count() const override { return kParts; }
  void append_frames(double time, std::vector<SE3>& frames) const override;
  [[nodiscard]] PersonState state(double time) const;

 private:
  std::vector<PersonState> story_;
  double scale_;
};

/// Adds a person's body, in clothes of random colours, to the object the builder is at; first_frame as given
/// by SceneBuilder::motion. body_height in metres.
void add_body(SceneBuilder& builder, int first_frame, double body_height, Clothes clothes, Random& random);

}  // namespace ipl_slam::synthetic
