#include "dataset/synthetic/person.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "dataset/synthetic/paint.hpp"

namespace ipl_slam::synthetic {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using std::numbers::pi;

// Lengths of a body 1.75 m high, metres.
constexpr double kBodyHeight = 1.75;
constexpr double kThigh = 0.43;
constexpr double kShin = 0.42;
constexpr double kAnkle = 0.08;
constexpr double kHipWidth = 0.095;
constexpr double kShoulderWidth = 0.20;
constexpr double kShoulderHeight = 0.47;  // over the pelvis
constexpr double kUpperArm = 0.29;
constexpr double kHipSwing = 0.42;  // radians
constexpr double kSitAngle = 1.5;   // radians, of hips and knees
// Two steps of two legs each swinging this far: feet then hardly slide.
constexpr double kMetresPerCycle = 4.0 * (kThigh + kShin) * 0.408;

constexpr double kFullStride = 0.8;  // m/s from which on legs swing fully
constexpr double kStep = 0.01;       // seconds between the stored states

SE3 turn_y(double angle, const Vector3d& at) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(angle, Vector3d::UnitY())), at};
}

double smooth_step(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

struct Leg {
  double hip, knee;  // radians; hip forward, knee back
  [[nodiscard]] double drop() const { return kThigh * std::cos(hip) + kShin * std::cos(hip - knee) + kAnkle; }
};

Leg leg_at(const PersonState& s, double phase) {
  const double lift = 0.5 * (1.0 + std::cos(phase));
  const double hip = s.stride * (kHipSwing * std::sin(phase) + 0.1 * lift);
  const double knee = s.stride * (0.06 + 0.85 * lift * lift);
  return {hip + s.sitting * (kSitAngle - hip), knee + s.sitting * (kSitAngle - knee)};
}

// Tells one person's story by stepping through time: goals are drawn one after the other, or read from a
// role, and the body follows.
class Storyteller {
 public:
  Storyteller(const WalkingSpace& space, std::optional<Seat> seat, double start_angle,
              const PersonMotion::Occupied& occupied, Random random)
      : space_(space), seat_(seat), occupied_(occupied), random_(random), angle_(start_angle) {
    state_.position = on_ring(angle_);
    direction_ = random_.chance(0.5) ? 1.0 : -1.0;
    state_.heading = angle_ + direction_ * pi / 2;
    heading_goal_ = state_.heading;
    walk_speed_ = random_.uniform(0.8, 1.15);
    walk_ring(random_.uniform(1.0, 3.0));
  }

  explicit Storyteller(const Role& role) : role_(role), walk_speed_(role.speed), stand_until_(role.wait) {
    state_.position = role.start;
    state_.heading = heading_goal_ = role.heading;
  }

  std::vector<PersonState> tell(double duration) {
    std::vector<PersonState> story;
    for (time_ = 0.0; time_ <= duration + 1.0; time_ += kStep) {
      story.push_back(state_);
      step();
    }
    return story;
  }

 private:
  [[nodiscard]] Vector2d on_ring(double angle) const {
    return space_.centre + space_.ring_radius * Vector2d(std::cos(angle), std::sin(angle));
  }

  void walk_ring(double radians) {
    const double step = direction_ * 0.06;
    for (double done = 0.0; done < radians; done += 0.06) route_.push_back(on_ring(angle_ += step));
  }

  void walk_ring_to(double goal) {
    double way = std::remainder(goal - angle_, 2 * pi);
    direction_ = way < 0.0 ? -1.0 : 1.0;
    walk_ring(std::abs(way));
  }

  void walk_line(const Vector2d& from, const Vector2d& to) {
    const int count = std::max(1, static_cast<int>((to - from).norm() / 0.08));
    for (int i = 1; i <= count; ++i) route_.push_back(from + (to - from) * i / count);
  }

  // Draws what to do after the last thing is done.
  void decide() {
    if (role_) {
      play();
      return;
    }
    if (sit_until_ > 0.0) {  // got up again
      sit_until_ = 0.0;
      walk_line(state_.position, on_ring(angle_));
      return;
    }
    if (approaching_seat_) {
      approaching_seat_ = false;
      sit_until_ = time_ + random_.uniform(4.0, 9.0);
      return;
    }
    const double draw = random_.uniform();
    if (draw < 0.30) {
      stand_until_ = time_ + random_.uniform(1.5, 4.0);
    } else if (draw < 0.50 && seat_) {
      const Vector2d out = seat_->position - space_.centre;
      walk_ring_to(std::atan2(out.y(), out.x()));
      walk_line(on_ring(angle_), seat_->position);
      approaching_seat_ = true;
      backwards_from_ = on_ring(angle_);
    } else if (draw < 0.65 && !space_.way_out.empty()) {
      const Vector2d out = space_.way_out.front() - space_.centre;
      walk_ring_to(std::atan2(out.y(), out.x()));
      std::vector<Vector2d> way = {on_ring(angle_)};
      way.insert(way.end(), space_.way_out.begin(), space_.way_out.end());
      for (std::size_t i = 1; i < way.size(); ++i) walk_line(way[i - 1], way[i]);
      for (std::size_t i = way.size() - 1; i > 0; --i) walk_line(way[i], way[i - 1]);
    } else {
      if (random_.chance(0.3)) direction_ = -direction_;
      walk_ring(random_.uniform(0.8, 4.0));
    }
  }

  // Sets out on the way of the role; after it, stands for ever.
  void play() {
    if (role_->way.empty()) stand_until_ = std::numeric_limits<double>::infinity();
    Vector2d from = state_.position;
    for (const Vector2d& to : role_->way) {
      walk_line(from, to);
      from = to;
    }
    role_->way.clear();
  }

  void step() {
    const bool waiting = time_ < stand_until_ || time_ < sit_until_;
    if (route_.empty() && !waiting && state_.sitting <= 0.0) decide();
    settle_on_seat();
    const double goal_speed =
        route_.empty() || time_ < stand_until_ || state_.sitting > 0.0 ? 0.0 : free_speed();
    speed_ += std::clamp(goal_speed - speed_, -4.0 * kStep, 1.6 * kStep);
    if (goal_speed == 0.0 && speed_ < 0.02) speed_ = 0.0;
    follow_route(speed_ * kStep);
    const double gap = std::remainder(heading_goal_ - state_.heading, 2 * pi);
    if (std::abs(gap) > 1e-3) state_.heading += std::clamp(5.0 * gap, -2.5, 2.5) * kStep;
    state_.phase += 2 * pi * speed_ * kStep / kMetresPerCycle;
    state_.stride = smooth_step(speed_ / kFullStride);
  }

  void settle_on_seat() {
    if (sit_until_ == 0.0 || !route_.empty()) return;
    const double rate = time_ < sit_until_ ? 1.0 : -1.0;
    sit_progress_ = std::clamp(sit_progress_ + rate * kStep / 1.2, 0.0, 1.0);
    state_.sitting = smooth_step(sit_progress_);
  }

  // Walking speed, slower where the route turns, and none while somebody is in the way.
  double free_speed() {
    for (const double ahead : {0.3, 0.6, 0.9}) {
      const std::size_t index =
          std::min(route_.size() - 1, static_cast<std::size_t>(ahead * walk_speed_ / 0.08));
      if (role_ || !occupied_(route_[index], time_ + ahead)) continue;
      blocked_for_ += kStep;
      if (blocked_for_ < 4.0) return 0.0;
    }
    blocked_for_ = std::max(0.0, blocked_for_ - 2.0 * kStep);
    const double turn = std::abs(std::remainder(heading_goal_ - state_.heading, 2 * pi));
    return walk_speed_ * std::max(0.15, 1.0 - 0.8 * turn) * std::min(1.0, 0.25 + 0.12 * route_.size());
  }

  void follow_route(double distance) {
    while (!route_.empty() && distance > 0.0) {
      const Vector2d way = route_.front() - state_.position;
      const double length = way.norm();
      if (length > 0.02) {
        // Towards a seat one walks backwards: the sitter already looks out of the ring.
        const bool backwards = approaching_seat_ && (backwards_from_ - route_.front()).norm() > 0.02 &&
                               (route_.front() - space_.centre).norm() < space_.ring_radius - 0.01;
        heading_goal_ = std::atan2(way.y(), way.x()) + (backwards ? pi : 0.0);
      }
      if (length <= distance) {
        state_.position = route_.front();
        route_.erase(route_.begin());
        distance -= length;
      } else {
        state_.position += way / length * distance;
        distance = 0.0;
      }
    }
  }

  WalkingSpace space_;
  std::optional<Seat> seat_;
  PersonMotion::Occupied occupied_;
  Random random_{0};
  std::optional<Role> role_;
  PersonState state_;
  double time_ = 0.0;
  double angle_ = 0.0, direction_ = 1.0, heading_goal_ = 0.0, speed_ = 0.0, walk_speed_ = 1.0;
  double stand_until_ = 0.0, sit_until_ = 0.0, sit_progress_ = 0.0, blocked_for_ = 0.0;
  bool approaching_seat_ = false;
  Vector2d backwards_from_{0, 0};
  std::vector<Vector2d> route_;
};

}  // namespace

PersonMotion::PersonMotion(const WalkingSpace& space, std::optional<Seat> seat, double start_angle,
                           double body_height, double duration, const Occupied& occupied, Random random)
    : story_(Storyteller(space, seat, start_angle, occupied, random).tell(duration)),
      scale_(body_height / kBodyHeight) {}

PersonMotion::PersonMotion(const Role& role, double body_height, double duration)
    : story_(Storyteller(role).tell(duration)), scale_(body_height / kBodyHeight) {}

PersonMotion::PersonMotion(const std::function<Vector2d(double)>& course, double body_height, double duration)
    : scale_(body_height / kBodyHeight) {
  PersonState state;
  for (double time = 0.0; time <= duration + 1.0; time += kStep) {
    state.position = course(time);
    const Vector2d way = course(time + kStep) - state.position;
    state.heading += std::remainder(std::atan2(way.y(), way.x()) - state.heading, 2 * pi);
    state.stride = smooth_step(way.norm() / kStep / kFullStride);
    story_.push_back(state);
    state.phase += 2 * pi * way.norm() / kMetresPerCycle;
  }
}

PersonState PersonMotion::state(double time) const {
  const double at = std::clamp(time / kStep, 0.0, static_cast<double>(story_.size() - 1));
  const auto index = std::min(static_cast<std::size_t>(at), story_.size() - 2);
  const double f = at - static_cast<double>(index);
  const PersonState& a = story_[index];
  const PersonState& b = story_[index + 1];
  return {a.position + f * (b.position - a.position), a.heading + f * (b.heading - a.heading),
          a.phase + f * (b.phase - a.phase), a.stride + f * (b.stride - a.stride),
          a.sitting + f * (b.sitting - a.sitting)};
}

void PersonMotion::append_frames(double time, std::vector<SE3>& frames) const {
  const PersonState s = state(time);
  const Leg left = leg_at(s, s.phase);
  const Leg right = leg_at(s, s.phase + pi);
  // The longer leg carries the body: its foot is on the floor.
  const double pelvis_height = scale_ * std::max(left.drop(), right.drop());
  const double k = scale_;
  const SE3 T_w_body(Eigen::Quaterniond(Eigen::AngleAxisd(s.heading, Vector3d::UnitZ())),
                     {s.position.x(), s.position.y(), pelvis_height});
  const double lean = 0.05 * s.stride + 0.45 * std::sin(pi * s.sitting);
  const double twist = 0.12 * s.stride * std::sin(s.phase);
  const SE3 T_w_chest =
      T_w_body * turn_y(lean, Vector3d::Zero()) *
      SE3(Eigen::Quaterniond(Eigen::AngleAxisd(twist, Vector3d::UnitZ())), Vector3d::Zero());
  const auto first = frames.size();
  frames.resize(first + kParts);
  SE3* const T_wf = frames.data() + first;
  T_wf[Pelvis] = T_w_body;
  T_wf[Chest] = T_w_chest;
  T_wf[Head] = T_w_chest * turn_y(-0.8 * lean, k * Vector3d(0, 0, kShoulderHeight + 0.09));
  for (const double side : {1.0, -1.0}) {
    const bool is_left = side > 0.0;
    const Leg& leg = is_left ? left : right;
    const double swing = -0.5 * s.stride * std::sin(s.phase) * side + 0.65 * s.sitting + 0.03;
    const SE3 T_w_arm = T_w_chest *
                        SE3(Eigen::Quaterniond(Eigen::AngleAxisd(0.13 * side, Vector3d::UnitX())),
                            k * Vector3d(0, side * kShoulderWidth, kShoulderHeight - 0.03)) *
                        turn_y(-swing, Vector3d::Zero());
    const double elbow = 0.2 + 0.25 * s.stride + 0.9 * s.sitting;
    T_wf[is_left ? LeftArm : RightArm] = T_w_arm;
    T_wf[is_left ? LeftForearm : RightForearm] = T_w_arm * turn_y(-elbow, k * Vector3d(0, 0, -kUpperArm));
    const SE3 T_w_thigh = T_w_body * turn_y(-leg.hip, k * Vector3d(0, side * kHipWidth, 0));
    const SE3 T_w_shin = T_w_thigh * turn_y(leg.knee, k * Vector3d(0, 0, -kThigh));
    const double ankle = 0.75 * (leg.hip - leg.knee);
    T_wf[is_left ? LeftThigh : RightThigh] = T_w_thigh;
    T_wf[is_left ? LeftShin : RightShin] = T_w_shin;
    T_wf[is_left ? LeftFoot : RightFoot] = T_w_shin * turn_y(ankle, k * Vector3d(0, 0, -kShin));
  }
}

void add_body(SceneBuilder& builder, int first_frame, double body_height, Clothes clothes, Random& random) {
  const double k = body_height / kBodyHeight;
  const auto cloth = [&](double low, double high, float strength) {
    const cv::Scalar color(random.uniform(low, high), random.uniform(low, high), random.uniform(low, high));
    return builder.material(paint_plain(256, color, strength, random), 400.0);
  };
  int shirt = cloth(60, 200, 16.0F);
  int trousers = cloth(35, 95, 12.0F);
  const int shoes = cloth(20, 50, 8.0F);
  const int hair = cloth(20, 75, 22.0F);
  const double tone = random.uniform(0.75, 1.0);
  const int skin = builder.material(paint_plain(128, cv::Scalar(140, 165, 215) * tone, 7.0F, random), 400.0);
  if (clothes == Clothes::Printed) {
    shirt = builder.material(paint_mosaic(512, 16, random), 800.0);
    trousers = builder.material(paint_mosaic(512, 16, random), 800.0);
  }
  const auto limb = [&](int part, const Vector3d& from, const Vector3d& to, double rx, double ry,
                        int material) {
    builder.on_frame(first_frame + part);
    builder.capsule(k * from, k * to, k * rx, k * ry, material);
  };
  using P = PersonMotion;
  limb(P::Pelvis, {0, -0.06, 0.0}, {0, 0.06, 0.0}, 0.115, 0.105, trousers);
  limb(P::Chest, {0, 0, 0.06}, {0, 0, 0.22}, 0.105, 0.150, shirt);
  limb(P::Chest, {0.005, 0, 0.24}, {0, 0, 0.38}, 0.115, 0.185, shirt);
  limb(P::Chest, {-0.01, -0.15, 0.43}, {-0.01, 0.15, 0.43}, 0.065, 0.065, shirt);
  limb(P::Chest, {0, 0, 0.46}, {0.01, 0, 0.58}, 0.055, 0.055, skin);
  limb(P::Head, {0.01, 0, 0.06}, {0.02, 0, 0.14}, 0.092, 0.078, skin);
  limb(P::Head, {-0.018, 0, 0.10}, {-0.004, 0, 0.162}, 0.094, 0.085, hair);
  limb(P::Head, {0.105, 0, 0.075}, {0.112, 0, 0.065}, 0.016, 0.014, skin);
  for (const double side : {1.0, -1.0}) {
    const bool left = side > 0.0;
    limb(P::Head, {0.096, 0.032 * side, 0.105}, {0.096, 0.034 * side, 0.105}, 0.013, 0.013, shoes);
    const int arm = left ? P::LeftArm : P::RightArm;
    const int forearm = left ? P::LeftForearm : P::RightForearm;
    const int thigh = left ? P::LeftThigh : P::RightThigh;
    const int shin = left ? P::LeftShin : P::RightShin;
    const int foot = left ? P::LeftFoot : P::RightFoot;
    limb(arm, {0, 0, 0}, {0, 0, -kUpperArm}, 0.052, 0.052, shirt);
    limb(forearm, {0, 0, 0}, {0, 0, -0.22}, 0.043, 0.043, shirt);
    limb(forearm, {0, 0, -0.25}, {0.01, 0, -0.32}, 0.040, 0.030, skin);
    limb(thigh, {0, 0, 0}, {0, 0, -kThigh}, 0.082, 0.080, trousers);
    limb(shin, {0, 0, 0}, {0, 0, -kShin + 0.02}, 0.066, 0.064, trousers);
    limb(foot, {-0.03, 0, -0.035}, {0.15, 0, -0.04}, 0.042, 0.045, shoes);
  }
}

}  // namespace ipl_slam::synthetic
