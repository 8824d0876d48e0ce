// Point features: extractor against OpenCV's ORB on the same images, undistortion, matchers. Images are
// generated; with the environment variable IPL_SLAM_DATA set to a folder of TUM sequences, their first frames
// are measured as well.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <string>

#include <benchmark/benchmark.h>
#include <opencv2/features2d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "features/matcher.hpp"
#include "features/orb_extractor.hpp"

namespace {

using namespace ipl_slam;

struct Frames {
  std::vector<cv::Mat> images, depths;
};

Frames generated_frames() {
  std::mt19937 random(1);
  const auto below = [&random](unsigned n) { return static_cast<int>(random() % n); };
  cv::Mat scene(600, 800, CV_8UC1, cv::Scalar(128));
  for (int i = 0; i < 2500; ++i) {
    cv::rectangle(scene, {below(800), below(600), 5 + below(60), 5 + below(60)}, cv::Scalar(below(256)),
                  cv::FILLED);
  }
  cv::GaussianBlur(scene, scene, {5, 5}, 1.0);
  Frames frames;
  for (int i = 0; i < 5; ++i) {
    frames.images.push_back(scene(cv::Rect(20 * i, 15 * i, 640, 480)).clone());
    frames.depths.emplace_back(480, 640, CV_16UC1, cv::Scalar(10000));
  }
  return frames;
}

// Files of a folder in the order of their names, which are timestamps.
std::vector<std::string> files_of(const std::filesystem::path& folder) {
  std::vector<std::string> files;
  if (!std::filesystem::is_directory(folder)) return files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    files.push_back(entry.path().string());
  std::sort(files.begin(), files.end());
  return files;
}

Frames recorded_frames(const std::filesystem::path& sequence) {
  Frames frames;
  const std::vector<std::string> color = files_of(sequence / "rgb"), depth = files_of(sequence / "depth");
  for (std::size_t i = 0; i < std::min({color.size(), depth.size(), std::size_t{50}}); ++i) {
    frames.images.push_back(cv::imread(color[i], cv::IMREAD_COLOR));
    frames.depths.push_back(cv::imread(depth[i], cv::IMREAD_UNCHANGED));
  }
  return frames;
}

Camera distorted_camera() {
  Camera camera;
  camera.fx = camera.fy = 517.0;
  camera.k1 = 0.262383;
  camera.k2 = -0.953104;
  camera.p1 = -0.005358;
  camera.p2 = 0.002628;
  camera.k3 = 1.163314;
  return camera;
}

const Features& features_of_frame(int i) {
  static const std::vector<Features> all = [] {
    const Frames frames = generated_frames();
    OrbExtractor extractor({}, distorted_camera(), {});
    std::vector<Features> features;
    for (std::size_t f = 0; f < 2; ++f)
      features.push_back(extractor.extract(frames.images[f], frames.depths[f]));
    return features;
  }();
  return all[static_cast<std::size_t>(i)];
}

void extract(benchmark::State& state, const Frames& frames) {
  OrbExtractor extractor({}, distorted_camera(), {});
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(extractor.extract(frames.images[i], frames.depths[i]));
    i = (i + 1) % frames.images.size();
  }
}

void opencv_orb(benchmark::State& state, const Frames& frames) {
  cv::setNumThreads(1);
  const cv::Ptr<cv::ORB> orb = cv::ORB::create(1000, 1.2F, 8);
  std::size_t i = 0;
  for (auto _ : state) {
    std::vector<cv::KeyPoint> keypoints;
    cv::Mat descriptors;
    orb->detectAndCompute(frames.images[i], cv::noArray(), keypoints, descriptors);
    benchmark::DoNotOptimize(descriptors.data);
    i = (i + 1) % frames.images.size();
  }
}

void undistort_1000(benchmark::State& state) {
  const Camera camera = distorted_camera();
  const Features& features = features_of_frame(0);
  for (auto _ : state) {
    for (const Keypoint& k : features.keypoints) {
      benchmark::DoNotOptimize(camera.undistort(k.pixel.cast<double>()));
    }
  }
}

void build_grid_1000(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(FeatureGrid(features_of_frame(0)));
}

void match_projected_1000(benchmark::State& state) {
  const Features &from = features_of_frame(0), &to = features_of_frame(1);
  const FeatureGrid grid(to);
  std::vector<ProjectedPoint> points;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Keypoint& k = from.keypoints[i];
    ProjectedPoint p;
    p.uv = k.undistorted - Eigen::Vector2f(20.0F, 15.0F);
    p.radius = 15.0F;
    p.min_level = k.level - 1;
    p.max_level = k.level + 1;
    p.descriptor = &from.descriptors[i];
    points.push_back(p);
  }
  for (auto _ : state) benchmark::DoNotOptimize(match_projected(to, grid, points, {}));
}

void match_brute_force_1000(benchmark::State& state, Simd simd) {
  for (auto _ : state) {
    benchmark::DoNotOptimize(match_brute_force(features_of_frame(0), features_of_frame(1), {}, simd));
  }
}

BENCHMARK(undistort_1000)->Unit(benchmark::kMicrosecond);
BENCHMARK(build_grid_1000)->Unit(benchmark::kMicrosecond);
BENCHMARK(match_projected_1000)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(match_brute_force_1000, portable, Simd::portable)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(match_brute_force_1000, best, best_simd())->Unit(benchmark::kMicrosecond);

void register_pair(const std::string& name, const Frames& frames) {
  if (frames.images.empty()) return;
  benchmark::RegisterBenchmark(("extract/" + name).c_str(), extract, frames)->Unit(benchmark::kMillisecond);
  benchmark::RegisterBenchmark(("opencv_orb/" + name).c_str(), opencv_orb, frames)
      ->Unit(benchmark::kMillisecond);
}

// Runs before benchmark_main's main(), which takes over from here.
const bool registered = [] {
  register_pair("generated", generated_frames());
  if (const char* folder = std::getenv("IPL_SLAM_DATA")) {
    for (const char* sequence : {"fr1_desk_100", "fr1_xyz_walking"}) {
      register_pair(sequence, recorded_frames(std::filesystem::path(folder) / sequence));
    }
  }
  return true;
}();

}  // namespace
