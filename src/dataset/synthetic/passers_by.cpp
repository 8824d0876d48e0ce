#include "dataset/synthetic/passers_by.hpp"

#include <cmath>
#include <memory>
#include <numbers>

namespace ipl_slam::synthetic {
namespace {

using Eigen::Vector2d;
using std::numbers::pi;

constexpr double kWeave = 0.15;     // m to either side
constexpr double kWeaveRate = 0.8;  // radians/s
constexpr double kCrossRate = 0.8;  // radians/s on the way to and fro: about 1 m/s in the middle of a room
constexpr double kLead = pi / kCrossRate;  // s, of the one ahead, whom people let pass at their other end
constexpr double kTurnWidth = 0.3;         // half width of the narrow ellipse on which one turns round, m

Vector2d left_of(const Vector2d& ahead) {
  return {-ahead.y(), ahead.x()};
}

Vector2d place_ahead(const LoopPath& loop, double time) {
  const double there = time + kLead;
  return loop.position(there) + kWeave * std::sin(kWeaveRate * time) * left_of(loop.direction(there));
}

}  // namespace

Vector2d crossing_place(const LoopPath& loop, const Crossing& crossing, double time) {
  const Vector2d ahead = loop.direction(crossing.time);
  // Half a round on the ellipse is left over after a lap: the next time it is crossed the other way.
  const double rounds = std::round(kCrossRate * loop.lap_time() / (2 * pi)) + 0.5;
  // At the far end when the camera comes: a quarter round before, one crossed in front of it.
  const double angle = pi / 2 + 2 * pi * rounds * (time - crossing.time) / loop.lap_time();
  return loop.position(crossing.time) + crossing.reach * std::sin(angle) * left_of(ahead) +
         kTurnWidth * std::cos(angle) * ahead;
}

void add_passers_by(SceneBuilder& builder, const CameraSite& site, const PassersBy& contents) {
  const std::size_t count = site.crossings.size();
  for (int i = 0; i < contents.people; ++i) {
    const auto course = [&, i](double time) {
      if (i == 0) return place_ahead(site.loop, time);
      const std::size_t which = static_cast<std::size_t>(i - 1) * count / (contents.people - 1);
      return crossing_place(site.loop, site.crossings.at(which), time);
    };
    Random random(hash64(hash64(contents.seed, 2), i));
    const double body_height = random.uniform(1.62, 1.86);
    builder.object("person");
    const int first = builder.motion(std::make_unique<PersonMotion>(course, body_height, contents.duration));
    add_body(builder, first, body_height, contents.clothes, random);
  }
}

}  // namespace ipl_slam::synthetic
