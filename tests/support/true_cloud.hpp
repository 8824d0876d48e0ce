#pragma once

#include <cmath>
#include <cstdint>
#include <set>
#include <tuple>

#include "dataset/synthetic/synthetic_source.hpp"
#include "dataset/trajectory.hpp"
#include "dense/semantic_cloud.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam::testing {

/// A cloud of exact depth, and the path it was seen from.
struct TrueCloud {
  SemanticCloud cloud;
  Trajectory trajectory;
};

/// What every `stride`-th frame of a rendered sequence shows, at most one point per voxel (m), labelled with
/// the classes of objects. World: frame 0 of the scene (z up), moved by T_ws.
inline TrueCloud true_cloud(const SyntheticOptions& options, std::size_t stride, double voxel,
                            const SE3& T_ws = {}) {
  const SyntheticSource source(options);
  const Camera camera = source.camera();
  TrueCloud result;
  ClassLabels labels;
  std::set<std::tuple<int, int, int>> taken;
  std::set<std::int32_t> seen;
  for (std::size_t frame = 0; frame < source.size(); frame += stride) {
    const SyntheticFrame shown = source.render(frame);
    const SE3 T_wc = T_ws * shown.T_wc;
    result.trajectory.push_back({source.timestamp(frame), T_wc});
    const auto at = [&](int u, int v) {
      return camera.unproject({u, v}, static_cast<double>(shown.true_depth.at<float>(v, u)));
    };
    for (int v = 1; v + 1 < shown.true_depth.rows; ++v) {
      for (int u = 1; u + 1 < shown.true_depth.cols; ++u) {
        const float depth = shown.true_depth.at<float>(v, u);
        const float across = shown.true_depth.at<float>(v, u + 1),
                    down = shown.true_depth.at<float>(v + 1, u);
        if (depth <= 0.0F || std::abs(across - depth) > 0.05F * depth ||
            std::abs(down - depth) > 0.05F * depth)
          continue;
        const Eigen::Vector3d p = at(u, v), w = shown.T_wc * p;
        const auto place = [&](int axis) { return static_cast<int>(std::floor(w[axis] / voxel)); };
        if (!taken.emplace(place(0), place(1), place(2)).second) continue;
        CloudPoint point;
        point.position = (T_wc * p).cast<float>();
        const Eigen::Vector3d normal = (at(u, v + 1) - p).cross(at(u + 1, v) - p).normalized();
        point.normal = (T_wc.rotation() * normal).cast<float>();
        const auto& c = shown.rgbd.color.at<cv::Vec3b>(v, u);
        point.color = {c[2], c[1], c[0]};
        const int object = shown.mask.at<std::uint8_t>(v, u);
        if (object > 0) {
          point.label = labels.label(source.objects()[static_cast<std::size_t>(object - 1)].class_name);
          point.confidence = 0.5F + 0.05F * static_cast<float>(point.label % 10);
          seen.insert(point.label);
        }
        result.cloud.points.push_back(point);
      }
    }
  }
  for (const std::int32_t label : seen)
    result.cloud.classes.push_back({label, labels.name(label), class_color(label)});
  return result;
}

}  // namespace ipl_slam::testing
