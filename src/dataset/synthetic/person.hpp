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

/// State of a person at one moment.
struct PersonState {
  Eigen::Vector2d position{0, 0};  ///< of the pelvis over the floor, metres
  double heading = 0.0;            ///< radians, continuous
  double phase = 0.0;              ///< of the walk cycle, radians
  double stride = 0.0;             ///< 0 standing .. 1 walking
  double sitting = 0.0;            ///< 0 upright .. 1 on the seat
};

/// A walking figure: walks the ring, stops for a while, sits down and gets up, leaves the room and comes
/// back, as the random generator decides; waits for others. The story is worked out once, for `duration`
/// seconds.
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

  [[nodiscard]] int frame_count() const override { return kParts; }
  void append_frames(double time, std::vector<SE3>& frames) const override;
  [[nodiscard]] PersonState state(double time) const;

 private:
  std::vector<PersonState> story_;
  double scale_;
};

/// Adds a person's body, in plain clothes of random colours, to the object the builder is at; first_frame as
/// given by SceneBuilder::motion. body_height in metres.
void add_body(SceneBuilder& builder, int first_frame, double body_height, Random& random);

}  // namespace ipl_slam::synthetic
