#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/options.hpp"
#include "dynamics/epipolar_check.hpp"
#include "features/frame.hpp"
#include "features/matcher.hpp"
#include "features/scale_pyramid.hpp"
#include "geometry/camera.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {

struct PointMotionOptions {
  std::string check = "depth";
  double search_radius = 30.0;
  double pixel_sigma = 1.0;
  double inverse_depth_sigma = 0.015;
  double threshold = 11.3;
  EpipolarCheckOptions epipolar;
  MatchOptions match{.max_distance = 60, .ratio = 0.8, .max_rotation = 0.35, .inverse_depth_gate = 0.0};

  template <class Visitor>
  void visit(Visitor& v) {
    v.choice("check", check, {"off", "epipolar", "depth"},
             "points of consecutive frames: epipolar = distance from the epipolar line (paper); depth = the "
             "earlier 3-D point, carried along with the camera, against what is measured");
    v.number("search_radius", search_radius,
             {1.0, 200.0, "px",
              "around where a still point would be, at pyramid level 0: what is faster is not found"});
    v.number("pixel_sigma", pixel_sigma,
             {0.1, 20.0, "px", "depth: deviation of the difference of two keypoints, at pyramid level 0"});
    v.number("inverse_depth_sigma", inverse_depth_sigma,
             {1e-4, 1.0, "1/m", "depth: deviation of the difference of two measured inverse depths"});
    v.number(
        "threshold", threshold,
        {0.1, 1000.0, "1",
         "depth: squared residual over its variance from which on a point is dynamic; 11.3 = 99 % of chi "
         "square with three degrees of freedom"});
    v.section("epipolar", epipolar, "epipolar geometry of consecutive frames");
    v.section("match", match, "matching of the points");
  }
};

/// What is known of the motion of a frame's keypoints. All vectors are parallel to these.
struct PointMotion {
  std::vector<std::uint8_t> judged;   ///< 1 where the check could be made
  std::vector<std::uint8_t> dynamic;  ///< 1 where the point moved by itself
  /// Squared residual over its variance (check "depth"); nothing where not judged.
  std::vector<std::optional<double>> surprise;
  /// Between the 3-D points of both frames, with the camera's motion removed, m; nothing without a match or
  /// without depth in both.
  std::vector<std::optional<double>> distance;
};

/// Tells points that moved by themselves from those that only seem to because the camera moved, by two frames
/// (paper, section 3.4).
class PointMotionCheck {
 public:
  PointMotionCheck(const Camera& camera, const ScalePyramid& pyramid, const PointMotionOptions& options,
                   std::uint64_t seed = 0);

  /// T_now_before maps the camera frame of the earlier frame to that of the present one; without it only the
  /// epipolar check is made. `witness`: 1 per keypoint of `now` that lies outside all candidate regions; the
  /// epipolar geometry comes from these.
  [[nodiscard]] PointMotion compare(const Frame& before, const Frame& now,
                                    const std::optional<SE3>& T_now_before,
                                    std::span<const std::uint8_t> witness) const;

 private:
  struct Pair {
    std::size_t before, now;  // keypoints
  };
  [[nodiscard]] std::vector<Pair> match(const Frame& before, const Frame& now, const SE3& T_now_before) const;
  void judge_by_depth(const Frame& before, const Frame& now, std::span<const Pair> pairs,
                      const SE3& T_now_before, PointMotion& motion) const;
  void judge_by_epipolar_lines(const Frame& before, const Frame& now, std::span<const Pair> pairs,
                               std::span<const std::uint8_t> witness, PointMotion& motion) const;
  void measure_distances(const Frame& before, const Frame& now, std::span<const Pair> pairs,
                         const SE3& T_now_before, PointMotion& motion) const;

  Camera camera_;
  ScalePyramid pyramid_;
  PointMotionOptions options_;
  std::uint64_t seed_;
};

}  // namespace ipl_slam
