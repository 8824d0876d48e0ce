#include "dynamics/line_motion_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include <Eigen/Cholesky>

#include "dynamics/adaptive_weights.hpp"
#include "geometry/line3.hpp"

namespace ipl_slam {
namespace {

constexpr int kComponents = 4;  // of the residual

/// Angle to the x-axis of the way from one pixel to another, rad; nothing for a way shorter than `still`.
std::optional<double> angle_of(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double still) {
  const Eigen::Vector2d way = to - from;
  if (!(way.norm() >= still) || way.isZero(0.0)) return std::nullopt;
  return std::atan2(way.y(), way.x());
}

/// |a - b| wrapped to [0, pi]; 0 where one is not known.
double difference(const std::optional<double>& a, const std::optional<double>& b) {
  if (!a || !b) return 0.0;
  return std::abs(std::remainder(*a - *b, 2.0 * std::numbers::pi));
}

/// A segment's end point as it is measured: undistorted pixel and inverse depth.
struct End {
  Eigen::Vector2d uv;
  double inverse_depth;
};

std::array<End, 2> ends(const LineSegment& s) {
  return {End{s.start.cast<double>(), s.depth.inverse_start}, End{s.end.cast<double>(), s.depth.inverse_end}};
}

/// Where an end point shows after the camera's motion, and how that depends on its inverse depth.
struct CarriedEnd {
  Eigen::Vector2d uv, uv_slope;
  double inverse_depth, inverse_depth_slope;
};

std::optional<CarriedEnd> carry(const Camera& camera, const SE3& T_now_before, const End& end) {
  // The point times its inverse depth w: R r + w t, with r the ray at z = 1.
  const Eigen::Vector3d& t = T_now_before.translation();
  const Eigen::Vector3d x = T_now_before.rotation() * camera.unproject(end.uv, 1.0) + end.inverse_depth * t;
  constexpr double kNearest = 1e-3;  // of the depth before; nearer or behind, it has no image
  if (!(x.z() > kNearest)) return std::nullopt;
  CarriedEnd result;
  result.uv = camera.project(x);
  result.uv_slope = {camera.fx * (t.x() - x.x() / x.z() * t.z()) / x.z(),
                     camera.fy * (t.y() - x.y() / x.z() * t.z()) / x.z()};
  result.inverse_depth = end.inverse_depth / x.z();
  result.inverse_depth_slope = (1.0 - result.inverse_depth * t.z()) / x.z();
  return result;
}

/// Covariance of what is measured at a segment's ends: offset across it at start and end (pixels), inverse
/// depth at start and end (1/m).
Eigen::Matrix4d end_covariance(const LineSegment& segment, const LineMotionOptions& options) {
  const double across = options.pixel_sigma * std::ldexp(1.0, segment.octave);
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  covariance.diagonal().head<2>().setConstant(across * across);
  covariance.bottomRightCorner<2, 2>() = segment.depth.covariance.cast<double>();
  covariance.diagonal().tail<2>().array() += options.inverse_depth_sigma * options.inverse_depth_sigma;
  return covariance;
}

/// Squared Mahalanobis distance between the line measured now and the one of the keyframe before, carried
/// along with the camera: at both ends of the one now, the distance across (e_l of the paper, section 3.5)
/// and the difference of inverse depth. Nothing where a depth is not known or the carried line has no image.
std::optional<double> chi2(const Camera& camera, const SE3& T_now_before, const LineSegment& before,
                           const LineSegment& now, const LineMotionOptions& options) {
  if (!before.depth.known() || !now.depth.known()) return std::nullopt;
  const auto [start_before, end_before] = ends(before);
  const auto start = carry(camera, T_now_before, start_before);
  const auto end = carry(camera, T_now_before, end_before);
  if (!start || !end) return std::nullopt;
  const auto line = image_line(start->uv, end->uv);
  if (!line) return std::nullopt;
  const Eigen::Vector2d normal = line->head<2>(), along = end->uv - start->uv;

  Eigen::Vector4d residual;
  Eigen::Matrix4d by_before = Eigen::Matrix4d::Zero();
  const std::array<End, 2> measured = ends(now);
  for (int k = 0; k < 2; ++k) {
    const End& m = measured[static_cast<std::size_t>(k)];
    // Along the carried line everything is affine: share t of what its end says, 1 - t of its start.
    const double t = (m.uv - start->uv).dot(along) / along.squaredNorm();
    residual[k] = signed_distance(*line, m.uv);
    residual[2 + k] = m.inverse_depth - (1.0 - t) * start->inverse_depth - t * end->inverse_depth;
    by_before.row(k) << t - 1.0, -t, (t - 1.0) * normal.dot(start->uv_slope), -t * normal.dot(end->uv_slope);
    by_before.row(2 + k) << 0.0, 0.0, (t - 1.0) * start->inverse_depth_slope, -t * end->inverse_depth_slope;
  }
  const Eigen::Matrix4d covariance =
      end_covariance(now, options) + by_before * end_covariance(before, options) * by_before.transpose();
  const double value = residual.dot(covariance.ldlt().solve(residual));
  return std::isfinite(value) ? std::optional<double>(value) : std::nullopt;
}

/// The smallest chi2 of the lines of the keyframe before that look like this one, nothing where none has any:
/// a pair that disagrees may just be a wrong match, and what lies where a still line should be is still.
std::optional<double> smallest_chi2(const Camera& camera, const SE3& T_now_before, const LineFeatures& before,
                                    const LineFeatures& now, std::size_t line,
                                    const LineMotionOptions& options) {
  std::optional<double> smallest;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (hamming_distance(before.descriptors[i], now.descriptors[line]) > options.match.max_distance) continue;
    const auto value = chi2(camera, T_now_before, before.segments[i], now.segments[line], options);
    if (value && (!smallest || *value < *smallest)) smallest = value;
  }
  return smallest;
}

}  // namespace

double mean_angle_difference(const LineSegment& before, const LineSegment& now, double still) {
  const Eigen::Vector2d start_before = before.start.cast<double>(), end_before = before.end.cast<double>();
  const Eigen::Vector2d start_now = now.start.cast<double>(), end_now = now.end.cast<double>();
  const auto t1 = angle_of(start_before, start_now, still);
  const auto t2 = angle_of(0.5 * (start_before + end_before), 0.5 * (start_now + end_now), still);
  const auto t3 = angle_of(end_before, end_now, still);
  return (difference(t1, t2) + difference(t1, t3) + difference(t2, t3)) / 3.0;
}

LineMotion LineMotionCheck::compare(const LineFeatures& before, const LineFeatures& now,
                                    const SE3& T_now_before) const {
  LineMotion motion{.matched = std::vector<std::uint8_t>(now.size()),
                    .dynamic = std::vector<std::uint8_t>(now.size()),
                    .weight = std::vector<double>(now.size(), 1.0)};
  if (options_.check == "off") return motion;
  for (const auto& [i, j] : match_lines(before, now, options_.match)) {
    const LineSegment& a = before.segments[static_cast<std::size_t>(i)];
    const auto k = static_cast<std::size_t>(j);
    const LineSegment& b = now.segments[k];
    if (options_.check == "angle") {
      const double angle = mean_angle_difference(a, b, options_.still);
      motion.matched[k] = 1;
      motion.dynamic[k] = angle > options_.max_angle;
      motion.weight[k] = line_weight(angle, options_.min_weight);
    } else if (auto distance = chi2(camera_, T_now_before, a, b, options_)) {
      if (*distance > options_.max_chi2) {
        distance = smallest_chi2(camera_, T_now_before, before, now, k, options_);
      }
      motion.matched[k] = 1;
      motion.dynamic[k] = *distance > options_.max_chi2;
      motion.weight[k] = residual_weight(*distance, kComponents, options_.max_chi2, options_.min_weight);
    }
  }
  return motion;
}

}  // namespace ipl_slam
