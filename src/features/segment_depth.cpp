#include "features/segment_depth.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>

#include <Eigen/LU>

#include "common/random.hpp"
#include "geometry/ransac.hpp"

namespace ipl_slam {
namespace {

constexpr double kSpacing = 1.5;          // pixels between samples; denser ones would be the same pixels
constexpr int kMaxSamples = 64;           // long segments: more would hardly sharpen the fit
constexpr std::uint32_t kMinInliers = 6;  // two fix the line, the others can tell a line from chance
// Pixels to either side: the depth image's outlines are off those of the colour image by 1 or 2.
constexpr int kReach = 3;
constexpr double kMinBaseline = 0.15;  // of two samples that start a fit; nearer ones give any slope
constexpr int kMaxDraws = 40;          // 99 % sure to hit when a third of the samples agree
constexpr std::uint64_t kSeed = 1;     // the draws of every segment are the same

struct Sample {
  double t;        // position along the undistorted segment, 0 at its start, 1 at its end
  double inverse;  // 1/z, 1/m
  bool edge;       // background shows beside it
};

/// Inverse depth (1 - t) at_0 + t at_1, through two or more samples.
class InverseDepthFit {
 public:
  using Model = Eigen::Vector2d;
  static constexpr std::size_t kSampleSize = 2;

  explicit InverseDepthFit(std::span<const Sample> samples) : samples_(samples) {}

  [[nodiscard]] std::size_t size() const { return samples_.size(); }

  [[nodiscard]] std::optional<Model> fit(std::span<const std::uint32_t> indices) const {
    if (indices.size() == kSampleSize &&
        std::abs(samples_[indices[0]].t - samples_[indices[1]].t) < kMinBaseline) {
      return std::nullopt;
    }
    const Eigen::Matrix2d N = normal_matrix(indices);
    if (!(N.determinant() > 1e-9)) return std::nullopt;
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    for (const std::uint32_t i : indices) {
      right += samples_[i].inverse * Eigen::Vector2d(1.0 - samples_[i].t, samples_[i].t);
    }
    return N.inverse() * right;
  }

  [[nodiscard]] double squared_error(const Model& model, std::uint32_t i) const {
    const double error = (1.0 - samples_[i].t) * model[0] + samples_[i].t * model[1] - samples_[i].inverse;
    return error * error;
  }

  [[nodiscard]] Eigen::Matrix2d normal_matrix(std::span<const std::uint32_t> indices) const {
    Eigen::Matrix2d N = Eigen::Matrix2d::Zero();
    for (const std::uint32_t i : indices) {
      const Eigen::Vector2d row(1.0 - samples_[i].t, samples_[i].t);
      N += row * row.transpose();
    }
    return N;
  }

 private:
  std::span<const Sample> samples_;
};

/// Reads depth along one segment.
class SegmentSampler {
 public:
  SegmentSampler(const cv::Mat& depth, const LineSegment& segment, const Camera& camera, double max_depth,
                 double edge_gap)
      : depth_(depth),
        camera_(camera),
        start_(segment.start.cast<double>()),
        span_((segment.end - segment.start).cast<double>()),
        scale_(camera.depth_scale),
        max_raw_(max_depth * scale_),
        edge_gap_(edge_gap) {
    const Eigen::Vector2d chord = (segment.end_pixel - segment.start_pixel).cast<double>();
    length_ = chord.norm();
    if (!(length_ > 0.0)) return;
    along_ = chord / length_;
    across_ = {-along_.y(), along_.x()};
  }

  /// Length as it lies in the image, pixels.
  [[nodiscard]] double length() const { return length_; }

  /// Sample about the position t, nothing where no depth is valid.
  [[nodiscard]] std::optional<Sample> at(double t) const {
    const Eigen::Vector2d uv = camera_.distort(start_ + t * span_);
    std::array<Pixel, 2 * kReach + 1> pixels;
    std::size_t count = 0;
    std::uint16_t nearest = 0, most_distant = 0;
    for (int k = 0; k <= 2 * kReach; ++k) {
      const int side = (k + 1) / 2 * (k % 2 ? 1 : -1);  // 0, 1, -1, 2, -2, ...
      const std::optional<Pixel> pixel = read(uv + side * across_);
      if (!pixel) continue;
      nearest = count == 0 ? pixel->raw : std::min(nearest, pixel->raw);
      most_distant = std::max(most_distant, pixel->raw);
      pixels[count++] = *pixel;
    }
    if (count == 0) return std::nullopt;
    const double farthest = scale_ / std::max(scale_ / nearest - edge_gap_, 1e-9);
    const auto* chosen = pixels.data();
    while (chosen->raw > farthest) ++chosen;  // the nearest itself ends the search at the latest
    // The pixel's centre is not quite at t.
    const double shift = (Eigen::Vector2d(chosen->x, chosen->y) - uv).dot(along_) / length_;
    return Sample{t + shift, scale_ / chosen->raw, most_distant > farthest};
  }

 private:
  struct Pixel {
    int x, y;
    std::uint16_t raw;
  };

  [[nodiscard]] std::optional<Pixel> read(const Eigen::Vector2d& uv) const {
    const double u = uv.x() + 0.5, v = uv.y() + 0.5;
    if (!(u >= 0.0 && v >= 0.0 && u < depth_.cols && v < depth_.rows)) return std::nullopt;
    const int x = static_cast<int>(u), y = static_cast<int>(v);
    const std::uint16_t raw = depth_.ptr<std::uint16_t>(y)[x];
    if (raw == 0 || raw > max_raw_) return std::nullopt;
    return Pixel{x, y, raw};
  }

  const cv::Mat& depth_;
  const Camera& camera_;
  Eigen::Vector2d start_, span_;  // undistorted
  Eigen::Vector2d along_ = Eigen::Vector2d::Zero(), across_ = Eigen::Vector2d::Zero();
  double length_ = 0.0;
  double scale_, max_raw_, edge_gap_;
};

double span_of(std::span<const Sample> samples, std::span<const std::uint32_t> indices) {
  const auto [first, last] =
      std::minmax_element(indices.begin(), indices.end(),
                          [&](std::uint32_t a, std::uint32_t b) { return samples[a].t < samples[b].t; });
  return samples[*last].t - samples[*first].t;
}

}  // namespace

SegmentDepth segment_depth(const cv::Mat& depth, const LineSegment& segment, const Camera& camera,
                           const DepthNoiseOptions& noise, const SegmentDepthOptions& options,
                           std::uint64_t seed) {
  CV_Assert(depth.empty() || depth.type() == CV_16UC1);
  const SegmentSampler sampler(depth, segment, camera, noise.max_depth, options.edge_gap);
  const int drawn = std::min(kMaxSamples, static_cast<int>(sampler.length() / kSpacing) + 1);
  if (depth.empty() || drawn < static_cast<int>(kMinInliers)) return {};

  std::array<Sample, kMaxSamples> buffer;
  std::size_t valid = 0;
  for (int i = 0; i < drawn; ++i) {
    if (const auto sample = sampler.at(i / (drawn - 1.0))) buffer[valid++] = *sample;
  }
  const std::span<const Sample> samples(buffer.data(), valid);

  const InverseDepthFit line(samples);
  const RansacOptions ransac_options{
      .threshold = options.tolerance,
      .max_iterations = kMaxDraws,
      .min_inliers = std::max<int>(kMinInliers, static_cast<int>(std::ceil(options.min_support * drawn)))};
  if (static_cast<int>(valid) < ransac_options.min_inliers) return {};
  Random random(seeded(kSeed, seed));
  const auto found = ransac(line, ransac_options, random);
  if (!found || span_of(samples, found->inliers) < options.min_span) return {};
  const auto model = line.fit(found->inliers);
  if (!model || !(model->minCoeff() * noise.max_depth > 1.0)) return {};

  double squares = 0.0;
  for (const std::uint32_t i : found->inliers) squares += line.squared_error(*model, i);
  const auto count = static_cast<double>(found->inliers.size());
  const double shared = std::max(1.0, options.correlation_length * (drawn - 1) / sampler.length());
  // The fit takes two of the independent samples' errors away with it.
  const double variance = squares / std::max(1.0, count - 2.0 * shared) * shared;
  const auto edges = std::count_if(found->inliers.begin(), found->inliers.end(),
                                   [&](std::uint32_t i) { return samples[i].edge; });
  const double common = 2.0 * static_cast<double>(edges) > count ? options.edge_sigma : options.resolution;
  const Eigen::Matrix2d covariance =
      variance * line.normal_matrix(found->inliers).inverse() + common * common * Eigen::Matrix2d::Identity();
  return {.inverse_start = static_cast<float>(model->x()),
          .inverse_end = static_cast<float>(model->y()),
          .covariance = covariance.cast<float>()};
}

}  // namespace ipl_slam
