#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/random.hpp"
#include "map/map.hpp"
#include "support/synthetic_world.hpp"

namespace ipl_slam::test {

/// A map after a life of its own: keyframes and landmarks that came, went and were joined, parts that were
/// merged, loops, features of every trust. The landmarks have nothing to do with the features that see them.
class EventfulMap {
 public:
  EventfulMap(int keyframes, std::size_t keypoints, std::size_t segments) : random_(keypoints) {
    for (int i = 0; i < keyframes; ++i) add_keyframe(i, keypoints, segments);
    for (const PartId part : map_.parts()) add_landmarks(part);
    map_.merge_parts(PartId{0}, PartId{1}, any_pose());
    for (std::uint32_t i = 2; i + 2 < static_cast<std::uint32_t>(keyframes); i += 3) {
      if (!map_.is_anchor(KeyframeId{i})) map_.remove_keyframe(KeyframeId{i});
    }
    map_.add_loop({map_.anchor(PartId{0}), KeyframeId{1}, any_pose()});
    map_.add_loop({KeyframeId{1}, map_.anchor(PartId{0}), any_pose()});
    std::vector<PointId> points;
    std::vector<LineId> lines;
    map_.points().for_each([&](PointId id, const Point&) { points.push_back(id); });
    map_.lines().for_each([&](LineId id, const Line&) { lines.push_back(id); });
    for (const PointId id : points) map_.refresh(id);
    for (const LineId id : lines) map_.refresh(id);
  }
  [[nodiscard]] Map take() { return std::move(map_); }

 private:
  // Three parts; keypoints have weights in every other keyframe, segments in every third.
  void add_keyframe(int i, std::size_t keypoints, std::size_t segments) {
    Features features;
    LineFeatures lines;
    for (std::size_t k = 0; k < keypoints; ++k) features.keypoints.push_back(any_keypoint());
    for (std::size_t k = 0; k < segments; ++k) lines.segments.push_back(any_segment());
    for (std::size_t k = 0; k < keypoints; ++k) features.descriptors.push_back(any_descriptor());
    for (std::size_t k = 0; k < segments; ++k) lines.descriptors.push_back(any_descriptor());
    const PartId part{map_.new_part().value < 3 ? map_.new_part().value : static_cast<std::uint32_t>(i % 3)};
    map_.add_keyframe(SyntheticWorld::make_frame(std::move(features), 10 * static_cast<std::size_t>(i)),
                      any_pose(), std::make_shared<const LineFeatures>(std::move(lines)),
                      i % 2 == 0 ? any_trust(keypoints) : FeatureTrust{},
                      i % 3 == 0 ? any_trust(segments) : FeatureTrust{}, part);
  }

  void add_landmarks(PartId part) {
    std::vector<KeyframeId> keyframes;
    map_.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
      if (keyframe.part == part) keyframes.push_back(id);
    });
    std::vector<PointId> points;
    std::vector<LineId> lines;
    for (const KeyframeId id : keyframes) {
      const Keyframe& keyframe = map_.keyframes()[id];
      for (std::uint32_t k = 0; k < keyframe.points.size(); ++k) {
        if (keyframe.points[k].valid() || keyframe.point_trust.weight(k) <= 0.0) continue;
        points.push_back(map_.add_point(any_place(), id, k));
        observe(points.back(), keyframes, keyframe.points.size());
      }
      for (std::uint32_t k = 0; k < keyframe.lines.size(); ++k) {
        if (keyframe.lines[k].valid() || keyframe.line_trust.weight(k) <= 0.0) continue;
        const Eigen::Vector3d start = any_place(), end = any_place();
        lines.push_back(map_.add_line(*Line3::through(start, end), start, end, id, k));
        observe(lines.back(), keyframes, keyframe.lines.size());
      }
    }
    if (points.size() > 5) {
      map_.remove(points[1]);
      map_.fuse(points[2], points[4]);
    }
    if (lines.size() > 2) map_.fuse(lines[0], lines[2]);
  }

  template <class LandmarkId>
  void observe(LandmarkId id, const std::vector<KeyframeId>& keyframes, std::size_t features) {
    for (int i = 0; i < 4; ++i) {
      map_.add_observation(id, keyframes[random_.index(keyframes.size())],
                           static_cast<std::uint32_t>(random_.index(features)));
    }
    map_.count_sightings(id, static_cast<int>(random_.index(100)), static_cast<int>(random_.index(50)));
    map_.refresh(id);
  }

  Eigen::Vector3d any_place() {
    return {random_.uniform(-3.0, 3.0), random_.uniform(-3.0, 3.0), random_.uniform(-3.0, 3.0)};
  }
  SE3 any_pose() {
    Vector6d twist;
    for (int k = 0; k < 6; ++k) twist[k] = random_.uniform(-1.0, 1.0);
    return SE3::exp(twist);
  }
  Eigen::Vector2f any_pixel() {
    return Eigen::Vector2d(random_.uniform(0.0, 639.0), random_.uniform(0.0, 479.0)).cast<float>();
  }
  float any(double low, double high) { return static_cast<float>(random_.uniform(low, high)); }
  Descriptor any_descriptor() { return {random_.bits(), random_.bits(), random_.bits(), random_.bits()}; }
  Keypoint any_keypoint() {
    return {any_pixel(),
            any_pixel(),
            any(0.0, 6.28),
            any(0.0, 100.0),
            random_.chance(0.5) ? any(0.5, 5.0) : 0.0F,
            static_cast<int>(random_.index(8))};
  }
  LineSegment any_segment() {
    LineSegment segment{any_pixel(), any_pixel(), any_pixel(), any_pixel(), any(1.0, 100.0), 1, {}};
    if (random_.chance(0.5)) {
      segment.depth = {any(0.2, 1.0), any(0.2, 1.0), Eigen::Matrix2f::Constant(1e-4F)};
      segment.depth.covariance(0, 0) = any(1e-3, 2e-3);
    }
    return segment;
  }
  FeatureTrust any_trust(std::size_t features) {
    FeatureTrust trust;
    for (std::size_t i = 0; i < features; ++i) {
      trust.weights.push_back(random_.chance(0.2) ? 0.0 : random_.uniform(0.05, 1.0));
      trust.regions.push_back(InstanceId{static_cast<std::uint32_t>(random_.index(3))});
    }
    return trust;
  }

  Random random_;
  Map map_{kTestPyramid};
};

inline Map eventful_map(int keyframes = 12, std::size_t keypoints = 6, std::size_t segments = 3) {
  return EventfulMap(keyframes, keypoints, segments).take();
}

}  // namespace ipl_slam::test
