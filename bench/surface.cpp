// From a filled volume to points, colours, classes and triangles.

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <benchmark/benchmark.h>
#include <opencv2/core.hpp>

#include "dense/cloud_painter.hpp"
#include "dense/marching_cubes.hpp"
#include "dense/surface_extractor.hpp"

namespace ipl_slam {
namespace {

constexpr double kVoxel = 0.01;
constexpr double kTruncation = 0.04;
const Eigen::Array3d kHalf(2.503, 1.352, 2.998);  // of an empty room about the origin, m

double distance(const Eigen::Vector3d& p) {
  return (kHalf - p.array().abs()).minCoeff();
}

const VoxelGrid& room() {
  static const VoxelGrid grid = [] {
    VoxelGrid made(kVoxel);
    constexpr int kSide = VoxelBlock::kSide;
    for (int z = -40; z < 40; ++z) {
      for (int y = -20; y < 20; ++y) {
        for (int x = -35; x < 35; ++x) {
          const double middle = distance(made.block_size() * Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5));
          if (std::abs(middle) > kTruncation + made.block_size()) continue;
          VoxelBlock& block = made.make({x, y, z});
          for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
            const VoxelCoord v{x * kSide + i % 8, y * kSide + i / 8 % 8, z * kSide + i / 64};
            const double d = distance(made.centre(v));
            if (std::abs(d) > kTruncation) continue;
            const auto at = static_cast<std::size_t>(i);
            block.weight[at] = 16;
            block.distance[at] =
                16 * static_cast<std::int32_t>(std::lround(d / kTruncation * VoxelBlock::kDistanceSteps));
          }
        }
      }
    }
    return made;
  }();
  return grid;
}

void BM_ExtractSurface(benchmark::State& state) {
  const VoxelGrid& grid = room();
  std::size_t points = 0;
  for (auto _ : state) points = extract_surface(grid, kTruncation, {}).size();
  state.counters["points"] = static_cast<double>(points);
  state.counters["blocks"] = static_cast<double>(grid.blocks().size());
}
BENCHMARK(BM_ExtractSurface)->Unit(benchmark::kMillisecond);

void BM_ExtractMesh(benchmark::State& state) {
  const VoxelGrid& grid = room();
  std::size_t triangles = 0;
  for (auto _ : state) triangles = extract_mesh(grid, kTruncation, {}).triangles.size();
  state.counters["triangles"] = static_cast<double>(triangles);
}
BENCHMARK(BM_ExtractMesh)->Unit(benchmark::kMillisecond);

void BM_ColorMesh(benchmark::State& state) {
  TriangleMesh mesh = extract_mesh(room(), kTruncation, {});
  SemanticCloud cloud;
  for (const SurfacePoint& p : extract_surface(room(), kTruncation, {})) {
    cloud.points.push_back({p.position, p.normal, {1, 2, 3}, CloudPoint::kUnlabelled, 0.0F});
  }
  for (auto _ : state) color_mesh(mesh, cloud, kVoxel);
}
BENCHMARK(BM_ColorMesh)->Unit(benchmark::kMillisecond);

// A camera in the middle of the room, turned by these angles about y and x.
struct RoomView {
  SE3 T_cw;
  cv::Mat color{480, 640, CV_8UC3, cv::Scalar(1, 2, 3)}, depth{480, 640, CV_32FC1, cv::Scalar(0)},
      labels{480, 640, CV_8UC1, cv::Scalar(0)};
  std::vector<ViewInstance> instances;

  RoomView(const Camera& camera, double yaw, double pitch) {
    Vector6d twist = Vector6d::Zero();
    twist.tail<3>() << pitch, yaw, 0.0;
    T_cw = SE3::exp(twist);
    const Eigen::Matrix3d R_wc = T_cw.rotation_matrix().transpose();
    for (int v = 0; v < 480; ++v) {
      for (int u = 0; u < 640; ++u) {
        const Eigen::Vector3d ray = R_wc * camera.unproject({u, v}, 1.0);
        depth.at<float>(v, u) = static_cast<float>((kHalf / ray.array().abs()).minCoeff());
      }
    }
    for (int k = 0; k < 6; ++k) {
      labels(cv::Rect(20 + 100 * k, 100, 90, 250)).setTo(k + 1);
      instances.push_back({InstanceId{static_cast<std::uint32_t>(k)}, k % 2 == 0 ? "chair" : "tv", 0.7F});
    }
  }
};

void BM_PaintView(benchmark::State& state) {
  const Camera camera;
  const std::vector<SurfacePoint> points = extract_surface(room(), kTruncation, {});
  const RoomView view(camera, 0.01 * static_cast<double>(state.range(0)), 0.2);
  const PaintView paint{view.color, view.depth, view.labels, view.instances};
  CloudPainter one(points, camera, {}), painter(points, camera, {});
  one.add(paint, view.T_cw);
  for (auto _ : state) painter.add(paint, view.T_cw);
  state.counters["seen"] = static_cast<double>(one.cloud().points.size());
}
BENCHMARK(BM_PaintView)->Arg(0)->Arg(70)->Arg(157)->Unit(benchmark::kMillisecond);

void BM_FinishCloud(benchmark::State& state) {
  const Camera camera;
  CloudPainter painter(extract_surface(room(), kTruncation, {}), camera, {});
  for (int k = 0; k < 12; ++k) {
    const RoomView view(camera, 0.5 * k, 0.2);
    painter.add({view.color, view.depth, view.labels, view.instances}, view.T_cw);
  }
  for (auto _ : state) {
    benchmark::DoNotOptimize(painter.cloud());
    benchmark::DoNotOptimize(painter.objects());
  }
}
BENCHMARK(BM_FinishCloud)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace ipl_slam
