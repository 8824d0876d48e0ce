#include "dataset/synthetic/story.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace ipl_slam::synthetic {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using std::numbers::pi;

// Ahead and left of the camera, metres. Who enters from a wing does not cross the way of who came before.
struct Place {
  Vector2d on_stage, wing;
};
const std::array<Place, kStagePlaces> kPlaces = {Place{{1.20, -0.36}, {1.3, 2.2}},
                                                 {{1.10, 0.33}, {1.9, 2.8}},
                                                 {{1.65, 0.95}, {2.35, 3.3}},
                                                 {{1.70, -0.85}, {1.0, -1.4}}};
constexpr double kBetweenEntries = 0.8;  // s

// A ring so narrow and near that four people on it hide most of what is behind them.
constexpr double kRingAhead = 1.22;
constexpr double kRingRadius = 0.42;
constexpr double kRingStep = 0.1;  // radians

constexpr double kBoxAhead = 1.45;
constexpr double kPushReach = 0.35;  // m to either side
constexpr double kPushRate = 0.9;    // radians/s: 0.32 m/s where it is fastest

Role crowd_role(const Stage& stage, int person, int people, double duration) {
  const double start = 2 * pi * person / people;
  const auto on_ring = [&](double angle) -> Vector2d {
    return stage.at(kRingAhead + kRingRadius * std::cos(angle), kRingRadius * std::sin(angle));
  };
  Role role{.start = on_ring(start), .heading = stage.heading + start + pi / 2};
  const double radians = role.speed * (duration + 1.0) / kRingRadius;
  for (double done = kRingStep; done < radians; done += kRingStep) role.way.push_back(on_ring(start + done));
  return role;
}

class LatePush : public Motion {
 public:
  LatePush(const Stage& stage, double start) : stage_(stage), start_(start) {}

  [[nodiscard]] int frame_count() const override { return 1; }
  void append_frames(double time, std::vector<SE3>& frames) const override {
    const double swing = 1.0 - std::cos(kPushRate * std::max(0.0, time - start_));  // at rest at the start
    const Vector2d at = stage_.at(kBoxAhead, kPushReach * (1.0 - swing));
    const Eigen::AngleAxisd turn(stage_.heading + 0.3 + 0.2 * swing, Vector3d::UnitZ());
    frames.emplace_back(Eigen::Quaterniond(turn), Vector3d(at.x(), at.y(), 0.0));
  }

 private:
  Stage stage_;
  double start_;
};

}  // namespace

Stage::Stage(const CameraSite& site)
    : station(site.station.head<2>()),
      heading(std::atan2(site.look_at.y() - site.station.y(), site.look_at.x() - site.station.x())) {}

Vector2d Stage::at(double ahead, double left) const {
  return station + Eigen::Rotation2Dd(heading) * Vector2d(ahead, left);
}

bool has_roles(const std::string& story) {
  return story == "stand" || story == "crowd" || story == "enter" || story == "leave";
}

Role make_role(const std::string& story, const Stage& stage, int person, int people, double duration,
               Random& random) {
  if (person >= kStagePlaces) throw std::invalid_argument("the stage has no place for that many people");
  if (story == "crowd") return crowd_role(stage, person, people, duration);
  const Place& place = kPlaces[person];
  const Vector2d on_stage = stage.at(place.on_stage.x(), place.on_stage.y());
  const Vector2d wing = stage.at(place.wing.x(), place.wing.y());
  const double to_camera = stage.heading + pi + random.uniform(-0.5, 0.5);
  const double cue = 0.25 * duration;
  if (story == "stand") return {.start = on_stage, .heading = to_camera};
  if (story == "enter") {
    return {.start = wing, .heading = to_camera, .wait = cue + person * kBetweenEntries, .way = {on_stage}};
  }
  if (story == "leave") {
    const double wait = cue + (people - 1 - person) * kBetweenEntries;
    return {.start = on_stage, .heading = to_camera, .wait = wait, .way = {wing}};
  }
  throw std::invalid_argument("the story '" + story + "' has no parts for people");
}

std::unique_ptr<Motion> make_late_push(const Stage& stage, double duration) {
  return std::make_unique<LatePush>(stage, duration / 3.0);
}

}  // namespace ipl_slam::synthetic
