#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "loop/loop_correction.hpp"
#include "support/synthetic_world.hpp"

namespace ipl_slam::test {

/// A camera that looks outwards while it turns, in the middle of a ring of points, once round and a little
/// more; the map of it as a tracker with drift makes it: every keyframe is off from the one before by the
/// same small step, and what it sees of the places it started from has landmarks of its own.
class DriftedTour {
 public:
  static constexpr std::size_t kTurn = 60;  ///< keyframes of one turn: 6 degrees apart
  static constexpr std::size_t kKeyframes = kTurn + 3;
  /// A landmark is found again for this many keyframes, then made anew.
  static constexpr std::size_t kMemory = 10;

  /// What odometry adds to a step of the camera: it climbs, and turns too far.
  [[nodiscard]] static Vector6d drift() { return {0.0, 0.002, 0.0, 0.0003, 0.0012, 0.0003}; }

  explicit DriftedTour(std::size_t first = 0, std::size_t end = kKeyframes, const Vector6d& step = drift())
      : world(5, 4000, {-5.0, -2.0, -5.0}, {5.0, 2.0, 5.0}) {
    extend(map, first, end, step);
  }

  /// Adds the keyframes of `first` to `end` as a part of their own.
  PartId extend(Map& map, std::size_t first, std::size_t end, const Vector6d& step) {
    const PartId part = map.new_part();
    std::vector<PointId> point_of(world.size());
    std::vector<std::size_t> made(world.size(), 0);
    SE3 T_cw = truth_of(first);
    for (std::size_t i = first; i < end; ++i) {
      if (i > first) T_cw = SE3::exp(step) * truth_of(i) * truth_of(i - 1).inverse() * T_cw;
      View view = world.look(truth_of(i), i, {.pixel_noise = 0.3, .inverse_depth_noise = 0.003});
      const KeyframeId id = map.add_keyframe(view.frame, T_cw, nullptr, {}, {}, part);
      const SE3 T_wc = T_cw.inverse();
      for (std::uint32_t k = 0; k < view.sources.size(); ++k) {
        const std::uint32_t source = view.sources[k];
        const Keypoint& keypoint = view.frame->features.keypoints[k];
        if (point_of[source].valid() && i - made[source] <= kMemory) {
          map.add_observation(point_of[source], id, k);
          map.refresh(point_of[source]);
        } else {
          point_of[source] = map.add_point(
              T_wc * kTestCamera.unproject(keypoint.undistorted.cast<double>(), keypoint.depth), id, k);
          made[source] = i;
        }
      }
      views.push_back(std::move(view));
      keyframes.push_back(id);
      truth.push_back(truth_of(i));
    }
    return part;
  }

  /// Exactly where the i-th keyframe made is in the world of the j-th, and which of the landmarks seen from
  /// around there it shows.
  [[nodiscard]] PlaceMatch match(std::size_t i, std::size_t j) const {
    PlaceMatch match;
    match.keyframe = keyframes[j];
    match.T_cw = truth[i] * truth[j].inverse() * map.keyframes()[keyframes[j]].T_cw;
    match.points.resize(views[i].sources.size());
    for (std::uint32_t k = 0; k < views[i].sources.size(); ++k) {
      const int there = views[j].keypoint_of(views[i].sources[k]);
      if (there >= 0) match.points[k] = map.keyframes()[keyframes[j]].points[static_cast<std::size_t>(there)];
    }
    return match;
  }

  /// Root mean square distance of the keyframes from where they should be, the first one being right, m.
  [[nodiscard]] double error(std::size_t from = 0) const {
    double sum = 0.0;
    const SE3 world_of = map.keyframes()[keyframes[0]].T_cw.inverse() * truth[0];  // true -> map
    for (std::size_t i = from; i < keyframes.size(); ++i) {
      const Eigen::Vector3d right = world_of * truth[i].inverse().translation();
      sum += (map.pose_of(keyframes[i]).inverse().translation() - right).squaredNorm();
    }
    return std::sqrt(sum / static_cast<double>(keyframes.size() - from));
  }
  /// Median distance of a keypoint with a landmark from where that shows, px.
  [[nodiscard]] double reprojection_error() const {
    std::vector<double> errors;
    map.points().for_each([&](PointId, const Point& point) {
      for (const Observation& o : point.observations) {
        const Keyframe& keyframe = map.keyframes()[o.keyframe];
        const Eigen::Vector2d uv = keyframe.frame->features.keypoints[o.feature].undistorted.cast<double>();
        errors.push_back((kTestCamera.project(keyframe.T_cw * point.position) - uv).norm());
      }
    });
    const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
    std::nth_element(errors.begin(), middle, errors.end());
    return *middle;
  }

  SyntheticWorld world;
  Map map{kTestPyramid};
  std::vector<View> views;
  std::vector<KeyframeId> keyframes;  ///< in the order they were made
  std::vector<SE3> truth;             ///< T_cw of each

 private:
  // 80 cm beside the middle, so that it moves as it turns.
  static SE3 truth_of(std::size_t i) {
    const double angle = 2.0 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(kTurn);
    return camera_at({0.8 * std::sin(angle), 0.0, 0.8 * std::cos(angle)}, angle);
  }
};

inline LoopCorrection loop_correction(const LoopCorrectionOptions& options = {}) {
  return {kTestCamera, kTestPyramid, kTestNoise, MappingOptions{}, options};
}

}  // namespace ipl_slam::test
