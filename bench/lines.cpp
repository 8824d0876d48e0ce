// Line segments: the detectors, whole and step by step, at 640x480. Images are generated; with the
// environment variable IPL_SLAM_DATA set to a folder of TUM sequences, their first frames are measured as
// well.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "dataset/camera_config.hpp"
#include "features/edge_chains.hpp"
#include "features/edge_map.hpp"
#include "features/line_detector.hpp"

namespace {

using namespace ipl_slam;

constexpr std::size_t kFrames = 10;

std::vector<cv::Mat> generated_images() {
  std::mt19937 random(1);
  const auto below = [&random](unsigned n) { return static_cast<int>(random() % n); };
  std::vector<cv::Mat> images;
  for (std::size_t f = 0; f < kFrames; ++f) {
    cv::Mat image(480, 640, CV_8UC1, cv::Scalar(128));
    for (int i = 0; i < 150; ++i) {
      const cv::RotatedRect box(cv::Point2f(below(640), below(480)),
                                cv::Size2f(20 + below(150), 20 + below(150)), below(90));
      cv::Point2f corners[4];
      box.points(corners);
      const std::vector<cv::Point> outline(corners, corners + 4);
      cv::fillConvexPoly(image, outline, cv::Scalar(below(256)), cv::LINE_AA);
    }
    cv::GaussianBlur(image, image, {5, 5}, 1.0);
    images.push_back(image);
  }
  return images;
}

std::vector<cv::Mat> recorded_images(const std::filesystem::path& sequence) {
  std::vector<std::string> files;
  if (std::filesystem::is_directory(sequence / "rgb")) {
    for (const auto& entry : std::filesystem::directory_iterator(sequence / "rgb")) {
      files.push_back(entry.path().string());
    }
  }
  std::sort(files.begin(), files.end());
  std::vector<cv::Mat> images;
  for (std::size_t i = 0; i < std::min(files.size(), kFrames); ++i) {
    images.push_back(cv::imread(files[i], cv::IMREAD_GRAYSCALE));
  }
  return images;
}

void detect(benchmark::State& state, const std::vector<cv::Mat>& images, LineMethod method) {
  cv::setNumThreads(1);
  LineDetector detector(method, {}, load_camera("tum1"));
  std::size_t frames = 0, segments = 0;
  for (auto _ : state) segments += detector.detect(images[frames++ % images.size()]).size();
  state.counters["segments"] = static_cast<double>(segments) / static_cast<double>(frames);
}

void edge_map(benchmark::State& state, const std::vector<cv::Mat>& images) {
  EdgeMap map;
  std::size_t i = 0;
  for (auto _ : state) {
    compute_edge_map(images[i++ % images.size()], 5 * kEdgeGradientUnit, map);
    benchmark::DoNotOptimize(map.is_ridge.data());
  }
}

void edge_chains(benchmark::State& state, const std::vector<cv::Mat>& images) {
  std::vector<EdgeMap> maps(images.size());
  for (std::size_t i = 0; i < images.size(); ++i) compute_edge_map(images[i], 5 * kEdgeGradientUnit, maps[i]);
  EdgeChainFinder finder;
  EdgeChains chains;
  std::size_t i = 0;
  for (auto _ : state) {
    finder.find(maps[i++ % maps.size()], 3 * kEdgeGradientUnit, 12, chains);
    benchmark::DoNotOptimize(chains.points.data());
  }
}

template <class... Args>
void add(const std::string& name, Args... args) {
  benchmark::RegisterBenchmark(name.c_str(), args...)->Unit(benchmark::kMillisecond);
}

void add_all(const std::string& name, const std::vector<cv::Mat>& images) {
  if (images.empty()) return;
  add("detect_lsd/" + name, detect, images, LineMethod::kLsd);
  add("detect_edges/" + name, detect, images, LineMethod::kEdges);
  add("edge_map/" + name, edge_map, images);
  add("edge_chains/" + name, edge_chains, images);
}

// Runs before benchmark_main's main(), which takes over from here.
const bool registered = [] {
  add_all("generated", generated_images());
  if (const char* folder = std::getenv("IPL_SLAM_DATA")) {
    for (const char* sequence : {"fr1_desk_100", "fr1_xyz_walking", "fr3_walking_halfsphere_49"}) {
      add_all(sequence, recorded_images(std::filesystem::path(folder) / sequence));
    }
  }
  return true;
}();

}  // namespace
