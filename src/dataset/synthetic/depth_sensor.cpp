#include "dataset/synthetic/depth_sensor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "common/random.hpp"

namespace ipl_slam::synthetic {
namespace {

constexpr float kLostCosine = 0.12F;  // flatter than this (83 degrees) the pattern is not found
constexpr float kWeakCosine = 0.26F;  // and from here (75 degrees) on less and less often
constexpr float kEdgeJump = 0.04F;    // relative jump of depth that makes an edge
constexpr double kRaggedEdge = 0.35;  // share of edge pixels without depth

// Marks the pixels of a row that the projector, `baseline` to the right of the camera, does not light. It
// sees pixel u at column u - f b / z; going left, a surface is lit only while that column keeps falling.
void mark_shadow(const float* depth, int width, double focal_baseline, std::vector<char>& dark) {
  double covered = std::numeric_limits<double>::infinity();
  for (int u = width - 1; u >= 0; --u) {
    dark[u] = 0;
    if (depth[u] <= 0.0F) continue;
    const double column = u - focal_baseline / depth[u];
    // A slanted surface may repeat a column within half a pixel without being hidden.
    dark[u] = column > covered + 0.5;
    covered = std::min(covered, column);
  }
}

bool at_edge(const cv::Mat& depth, int u, int v) {
  const float z = depth.at<float>(v, u);
  const float left = depth.at<float>(v, std::max(0, u - 1));
  const float right = depth.at<float>(v, std::min(depth.cols - 1, u + 1));
  const float above = depth.at<float>(std::max(0, v - 1), u);
  const float below = depth.at<float>(std::min(depth.rows - 1, v + 1), u);
  // Second differences: a slanted plane has none, however steep.
  return std::abs(left + right - 2.0F * z) > kEdgeJump * z ||
         std::abs(above + below - 2.0F * z) > kEdgeJump * z;
}

bool lost(const cv::Mat& depth, int u, int v, float cosine, std::uint64_t bits) {
  if (cosine < kLostCosine) return true;
  const double chance = unit_from_bits(bits);
  if (cosine < kWeakCosine && chance < (kWeakCosine - cosine) / (kWeakCosine - kLostCosine)) return true;
  return chance < kRaggedEdge && at_edge(depth, u, v);
}

}  // namespace

cv::Mat measure_depth(const cv::Mat& depth, const cv::Mat& incidence, const Camera& camera,
                      const DepthSensorOptions& options, std::uint64_t noise_seed) {
  cv::Mat measured = cv::Mat::zeros(depth.size(), CV_32FC1);
  std::vector<char> dark(static_cast<std::size_t>(depth.cols));
  for (int v = 0; v < depth.rows; ++v) {
    const auto* truth = depth.ptr<float>(v);
    const auto* cosine = incidence.ptr<float>(v);
    auto* out = measured.ptr<float>(v);
    mark_shadow(truth, depth.cols, camera.fx * options.baseline, dark);
    for (int u = 0; u < depth.cols; ++u) {
      const double z = truth[u];
      if (z <= 0.0 || z < options.min_range || z > options.max_range) continue;
      const std::uint64_t bits = hash64(noise_seed, static_cast<std::uint64_t>(v) * depth.cols + u);
      if (options.holes && (dark[u] || lost(depth, u, v, cosine[u], mix64(bits)))) continue;
      double disparity = options.focal_baseline / z + options.disparity_sigma * fast_normal_from_bits(bits);
      if (options.disparity_step > 0.0) {
        disparity = std::round(disparity / options.disparity_step) * options.disparity_step;
      }
      const double noisy = disparity > 0.0 ? options.focal_baseline / disparity : 0.0;
      if (noisy <= options.max_range) out[u] = static_cast<float>(noisy);
    }
  }
  return measured;
}

cv::Mat depth_to_raw(const cv::Mat& depth, double depth_scale) {
  cv::Mat raw(depth.size(), CV_16UC1);
  for (int v = 0; v < depth.rows; ++v) {
    const auto* metres = depth.ptr<float>(v);
    auto* out = raw.ptr<std::uint16_t>(v);
    for (int u = 0; u < depth.cols; ++u) {
      const double value = std::round(metres[u] * depth_scale);
      out[u] = value > 0.0 && value < 65536.0 ? static_cast<std::uint16_t>(value) : 0;
    }
  }
  return raw;
}

cv::Mat expose_color(const cv::Mat& color, double read_sigma, double shot_gain, std::uint64_t noise_seed) {
  std::array<float, 256> sigma{};
  for (int i = 0; i < 256; ++i)
    sigma[i] = static_cast<float>(std::sqrt(read_sigma * read_sigma + shot_gain * i));
  const bool noisy = read_sigma > 0.0 || shot_gain > 0.0;
  cv::Mat image(color.size(), CV_8UC3);
  for (int v = 0; v < color.rows; ++v) {
    const auto* in = color.ptr<float>(v);
    auto* out = image.ptr<std::uint8_t>(v);
    const int values = 3 * color.cols;
    for (int i = 0; i < values; ++i) {
      float value = in[i];
      if (noisy) {
        const std::uint64_t bits = hash64(noise_seed, static_cast<std::uint64_t>(v) * values + i);
        value +=
            sigma[static_cast<std::size_t>(std::clamp(value, 0.0F, 255.0F))] * fast_normal_from_bits(bits);
      }
      out[i] = static_cast<std::uint8_t>(std::clamp(value + 0.5F, 0.0F, 255.0F));
    }
  }
  return image;
}

}  // namespace ipl_slam::synthetic
