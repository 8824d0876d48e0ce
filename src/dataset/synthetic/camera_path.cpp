#include "dataset/synthetic/camera_path.hpp"

#include <cmath>
#include <numbers>

#include <ipl_slam/error.hpp>

namespace ipl_slam::synthetic {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

SE3 orbit(const CameraSite& site, double t) {
  const double angle = 0.175 * t - 0.6 * pi;  // rad; 0.4 m/s at 2.3 m from the middle
  const Vector3d eye(site.look_at.x() + site.orbit_radii.x() * std::cos(angle),
                     site.look_at.y() + site.orbit_radii.y() * std::sin(angle),
                     site.eye_height + 0.10 * std::sin(0.5 * t) + 0.004 * std::sin(6.0 * t));
  const Vector3d sway(0.30 * std::sin(0.31 * t), 0.25 * std::cos(0.23 * t),
                      0.15 * std::sin(0.4 * t) + 0.01 * std::sin(4.7 * t));
  return look_at(eye, site.look_at + sway);
}

SE3 sweep(const CameraSite& site, double t) {
  const Vector3d span = site.sweep_to - site.sweep_from;
  // The frequency at which the fastest point of the sine runs at 0.4 m/s.
  const double along = 0.5 - 0.5 * std::cos(0.8 / span.norm() * t);
  Vector3d eye = site.sweep_from + along * span;
  eye.z() += 0.06 * std::sin(0.7 * t);
  const Vector3d side(-span.y(), span.x(), 0.0);
  const double swing = 0.45 * std::sin(0.45 * t);
  const Eigen::AngleAxisd turn(swing, Vector3d::UnitZ());
  const Vector3d forward = turn * side.normalized() + Vector3d(0, 0, -0.22 + 0.06 * std::sin(0.6 * t));
  return look_at(eye, eye + forward);
}

// Share of a way that is done after a share of its time, with a run-up and a slowing down of `ramp` each.
double eased(double share, double ramp) {
  const double top_speed = 1.0 / (1.0 - ramp);
  if (share < ramp) return 0.5 * top_speed * share * share / ramp;
  if (share > 1.0 - ramp) return 1.0 - eased(1.0 - share, ramp);
  return top_speed * (share - 0.5 * ramp);
}

// Legs between the two ends at walking pace with a turn on the spot after each.
SE3 walk(const CameraSite& site, double t) {
  constexpr double kSpeed = 0.6;     // m/s, on the straight; bobbing and swaying add to it
  constexpr double kRunUp = 1.0;     // s
  constexpr double kTurnTime = 9.0;  // s
  const Vector3d span = site.sweep_to - site.sweep_from;
  const double leg_time = span.norm() / kSpeed + kRunUp;
  const double leg = std::floor(t / (leg_time + kTurnTime));
  const double in_leg = t - leg * (leg_time + kTurnTime);
  const bool back = std::fmod(leg, 2.0) != 0.0;
  const double done = eased(std::min(1.0, in_leg / leg_time), kRunUp / leg_time);
  const double turn = eased(std::max(0.0, in_leg - leg_time) / kTurnTime, 0.3);
  const double turned = pi * (back ? 1.0 - turn : turn);  // over the same side both times: the scene's
  const Vector3d ahead = span.normalized();
  const Vector3d left(-ahead.y(), ahead.x(), 0.0);
  const Vector3d eye = site.sweep_from + (back ? 1.0 - done : done) * span + 0.10 * std::sin(0.8 * t) * left +
                       Vector3d(0, 0, 0.015 * std::sin(7.0 * t));
  const Eigen::AngleAxisd heading(turned + 0.22 * std::sin(0.5 * t) + 0.01 * std::sin(3.5 * t),
                                  Vector3d::UnitZ());
  return look_at(eye, eye + heading * ahead + Vector3d(0, 0, -0.12 + 0.06 * std::sin(0.37 * t)));
}

// A round through a building on foot: the eyes go ahead into each turn, and about.
SE3 loop(const CameraSite& site, double t) {
  constexpr double kLookAhead = 2.0;  // s
  const Eigen::Vector2d at = site.loop.position(t);
  const Eigen::Vector2d goal = site.loop.position(t + kLookAhead);
  const Vector3d ahead = Vector3d(goal.x() - at.x(), goal.y() - at.y(), 0.0).normalized();
  const Vector3d left(-ahead.y(), ahead.x(), 0.0);
  const Vector3d eye = Vector3d(at.x(), at.y(), site.eye_height) + 0.06 * std::sin(0.8 * t) * left +
                       Vector3d(0, 0, 0.012 * std::sin(7.0 * t));
  const Eigen::AngleAxisd about(0.16 * std::sin(0.5 * t) + 0.008 * std::sin(3.5 * t), Vector3d::UnitZ());
  return look_at(eye, eye + about * ahead + Vector3d(0, 0, -0.10 + 0.06 * std::sin(0.37 * t)));
}

// A pulse out, back past the start and home again within each turn of `period` seconds; at rest at both ends.
// The turns belong to the axes x, y, z in order.
Vector3d turns(double t, double period, double amplitude) {
  const auto turn = static_cast<long>(std::floor(t / period));
  const double phase = t / period - static_cast<double>(turn);
  Vector3d result = Vector3d::Zero();
  result[turn % 3] = amplitude * 1.3 * std::sin(2 * pi * phase) * std::pow(std::sin(pi * phase), 2);
  return result;
}

SE3 halfsphere(const CameraSite& site, double t) {
  const Vector3d from = site.station - site.look_at;
  const double radius = from.norm();
  const double azimuth = std::atan2(from.y(), from.x()) + 0.13 * std::sin(0.75 * t);
  const double elevation = std::asin(from.z() / radius) + 0.11 * std::sin(1.05 * t);
  const Vector3d eye =
      site.look_at + radius * Vector3d(std::cos(elevation) * std::cos(azimuth),
                                       std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
  return look_at(eye, site.look_at);
}

}  // namespace

SE3 look_at(const Vector3d& eye, const Vector3d& target) {
  Eigen::Matrix3d R_wc;
  R_wc.col(2) = (target - eye).normalized();
  R_wc.col(0) = R_wc.col(2).cross(Vector3d::UnitZ()).normalized();
  R_wc.col(1) = R_wc.col(2).cross(R_wc.col(0));
  return {R_wc, eye};
}

SE3 camera_pose(const std::string& path, const CameraSite& site, double time) {
  const SE3 T_station = look_at(site.station, site.look_at);
  if (path == "orbit") return orbit(site, time);
  if (path == "sweep") return sweep(site, time);
  if (path == "walk") return walk(site, time);
  if (path == "loop") return loop(site, time);
  if (path == "xyz") return SE3(Eigen::Quaterniond::Identity(), turns(time, 5.0, 0.28)) * T_station;
  if (path == "rpy") {
    Vector6d twist;
    twist << Vector3d::Zero(), turns(time, 5.0, 0.35);
    return T_station * SE3::exp(twist);
  }
  if (path == "halfsphere") return halfsphere(site, time);
  if (path == "static") return T_station;
  throw UserError("trajectory '" + path +
                  "' is not known: use orbit, sweep, walk, loop, xyz, rpy, halfsphere or static");
}

}  // namespace ipl_slam::synthetic
