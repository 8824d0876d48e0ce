#include "features/line_descriptor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <utility>

#include <opencv2/imgproc.hpp>

namespace ipl_slam {
namespace {

constexpr std::size_t kPairs = 32;   // of bands
constexpr std::size_t kSums = 4;     // positive and negative gradient across, then along
constexpr std::size_t kEntries = 8;  // mean and standard deviation of each
static_assert(kPairs * kEntries == 8 * sizeof(Descriptor));

// Sample positions are integers of 2^-16 pixel, directions of 2^-10, so that sums are exact.
constexpr int kPositionBits = 16;
constexpr int kDirectionBits = 10;

// A segment closer to a point than this has no direction of its own, pixels.
constexpr float kMinLength = 1e-3F;

/// The horizontal and vertical derivative of one octave, side by side.
struct Gradients {
  int width = 0, height = 0;
  std::vector<std::array<std::int16_t, 2>> values;

  explicit Gradients(const cv::Mat& grey) : width(grey.cols), height(grey.rows) {
    // A little smoothing makes the nearest pixel as good as an interpolated one.
    cv::Mat smooth, dx, dy;
    cv::GaussianBlur(grey, smooth, {5, 5}, 1.0);
    cv::Sobel(smooth, dx, CV_16S, 1, 0);
    cv::Sobel(smooth, dy, CV_16S, 0, 1);
    values.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for (int y = 0, i = 0; y < height; ++y) {
      const auto* gx = dx.ptr<std::int16_t>(y);
      const auto* gy = dy.ptr<std::int16_t>(y);
      for (int x = 0; x < width; ++x, ++i) values[static_cast<std::size_t>(i)] = {gx[x], gy[x]};
    }
  }
};

std::vector<Gradients> gradient_octaves(const cv::Mat& grey, int count) {
  std::vector<Gradients> octaves;
  cv::Mat image = grey;
  for (int k = 0; k < count; ++k) {
    if (k > 0) {
      const cv::Size half(std::max(1, image.cols / 2), std::max(1, image.rows / 2));
      cv::Mat smaller;
      cv::resize(image, smaller, half, 0, 0, cv::INTER_AREA);
      image = smaller;
    }
    octaves.emplace_back(image);
  }
  return octaves;
}

/// A segment in its octave: samples at origin + i step, for i below count, and its axes.
struct Support {
  Eigen::Vector2d origin, step, across;
  int count = 1;

  explicit Support(const LineSegment& segment) {
    // The centre of a halved pixel lies between those of the four it was made of.
    const double scale = std::ldexp(1.0, -segment.octave);
    const auto in_octave = [&](const Eigen::Vector2f& p) -> Eigen::Vector2d {
      return (p.cast<double>().array() + 0.5) * scale - 0.5;
    };
    origin = in_octave(segment.start_pixel);
    const Eigen::Vector2d way = in_octave(segment.end_pixel) - origin;
    const double length = way.norm();
    step = length < kMinLength ? Eigen::Vector2d::UnitX() : Eigen::Vector2d(way / length);
    across = {-step.y(), step.x()};
    count = 1 + static_cast<int>(length);
  }
};

std::int64_t to_fixed(double value, int bits) {
  return std::llround(std::ldexp(value, bits));
}

/// The samples [first, last) of position + i step (fixed point) that lie in [0, size).
std::pair<std::int64_t, std::int64_t> inside(std::int64_t position, std::int64_t step, int size,
                                             std::int64_t count) {
  const std::int64_t end = static_cast<std::int64_t>(size) << kPositionBits;
  if (step == 0)
    return position >= 0 && position < end ? std::pair{std::int64_t{0}, count} : std::pair{count, count};
  if (step < 0) return inside(end - 1 - position, -step, size, count);
  const auto steps_to = [&](std::int64_t target) {  // the first i with position + i step >= target
    return position >= target ? 0 : (target - position + step - 1) / step;
  };
  return {std::min(count, steps_to(0)), std::min(count, steps_to(end))};
}

using Row = std::array<float, kSums>;

/// The four means of one row; false where no sample of it lies inside the image.
bool row_means(const Gradients& gradients, const Support& support, double offset, Row& row) {
  // Half a pixel more, so that cutting off the fraction rounds to the nearest.
  const Eigen::Vector2d start = support.origin + offset * support.across + Eigen::Vector2d::Constant(0.5);
  std::int64_t x = to_fixed(start.x(), kPositionBits), y = to_fixed(start.y(), kPositionBits);
  const std::int64_t step_x = to_fixed(support.step.x(), kPositionBits);
  const std::int64_t step_y = to_fixed(support.step.y(), kPositionBits);
  const auto in_x = inside(x, step_x, gradients.width, support.count);
  const auto in_y = inside(y, step_y, gradients.height, support.count);
  const std::int64_t first = std::max(in_x.first, in_y.first), last = std::min(in_x.second, in_y.second);
  if (first >= last) return false;

  const int c = static_cast<int>(to_fixed(support.step.x(), kDirectionBits));
  const int s = static_cast<int>(to_fixed(support.step.y(), kDirectionBits));
  std::int64_t across = 0, along = 0, positive_across = 0, positive_along = 0;
  x += first * step_x, y += first * step_y;
  for (std::int64_t i = first; i < last; ++i, x += step_x, y += step_y) {
    const auto& g =
        gradients
            .values[static_cast<std::size_t>((y >> kPositionBits) * gradients.width + (x >> kPositionBits))];
    const int g_across = c * g[1] - s * g[0];
    const int g_along = c * g[0] + s * g[1];
    across += g_across, along += g_along;
    positive_across += std::max(g_across, 0), positive_along += std::max(g_along, 0);
  }
  const float scale = 1.0F / static_cast<float>(last - first);
  row = {static_cast<float>(positive_across) * scale, static_cast<float>(positive_across - across) * scale,
         static_cast<float>(positive_along) * scale, static_cast<float>(positive_along - along) * scale};
  return true;
}

/// What depends on the options alone.
class BandLayout {
 public:
  explicit BandLayout(const LineDescriptorOptions& options)
      : bands_(static_cast<std::size_t>(options.bands)),
        width_(static_cast<std::size_t>(options.band_width)) {
    weigh_rows();
    choose_pairs();
  }

  [[nodiscard]] std::size_t rows() const { return bands_ * width_; }
  /// Of a row from the segment, pixels.
  [[nodiscard]] double offset(std::size_t row) const {
    return static_cast<double>(row) - 0.5 * static_cast<double>(rows() - 1);
  }
  [[nodiscard]] Descriptor describe(std::span<const Row> rows, std::span<const char> seen) const {
    std::vector<std::array<float, kEntries>> bands(bands_);
    for (std::size_t b = 0; b < bands_; ++b) bands[b] = entries(b, rows, seen);
    Descriptor bits{};
    std::size_t bit = 0;
    for (const auto& [i, j] : pairs_) {
      for (std::size_t e = 0; e < kEntries; ++e, ++bit) {
        if (bands[i][e] > bands[j][e]) bits[bit / 64] |= std::uint64_t{1} << (bit % 64);
      }
    }
    return bits;
  }

 private:
  // Over the whole region sigma is half its reach; over a band and its neighbours, the width of a band.
  void weigh_rows() {
    const double global_sigma = 0.5 * static_cast<double>(rows() - 1);
    for (std::size_t r = 0; r < rows(); ++r) {
      global_.push_back(static_cast<float>(std::exp(-0.5 * std::pow(offset(r) / global_sigma, 2))));
    }
    const double width = static_cast<double>(width_);
    for (std::size_t r = 0; r < 3 * width_; ++r) {
      const double d = static_cast<double>(r) - 0.5 * (3.0 * width - 1.0);
      local_.push_back(static_cast<float>(std::exp(-0.5 * std::pow(d / width, 2))));
    }
  }

  void choose_pairs() {
    for (std::size_t i = 0; i < bands_; ++i) {
      for (std::size_t j = i + 1; j < bands_; ++j) pairs_.emplace_back(i, j);
    }
    const auto rank = [this](const std::pair<std::size_t, std::size_t>& p) {
      const auto off_middle =
          static_cast<int>(p.first + p.second) - static_cast<int>(bands_ - 1);  // twice the distance
      return std::pair{p.second - p.first, std::abs(off_middle)};
    };
    std::stable_sort(pairs_.begin(), pairs_.end(),
                     [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
    pairs_.resize(kPairs);
  }

  [[nodiscard]] std::array<float, kEntries> entries(std::size_t band, std::span<const Row> rows,
                                                    std::span<const char> seen) const {
    std::array<float, kSums> sum{}, squares{};
    int count = 0;
    for (std::size_t k = band == 0 ? width_ : 0; k < 3 * width_; ++k) {
      const std::size_t r = (band * width_ + k) - width_;
      if (r >= rows.size()) break;
      if (seen[r] == 0) continue;
      ++count;
      const float weight = global_[r] * local_[k];
      for (std::size_t v = 0; v < kSums; ++v) {
        const float value = weight * rows[r][v];
        sum[v] += value, squares[v] += value * value;
      }
    }
    std::array<float, kEntries> result{};
    if (count == 0) return result;
    const float n = static_cast<float>(count);
    for (std::size_t v = 0; v < kSums; ++v) {
      const float mean = sum[v] / n;
      result[v] = mean;
      result[kSums + v] = squares[v] / n - mean * mean;  // the root would not change a comparison
    }
    return result;
  }

  std::size_t bands_, width_;
  std::vector<float> global_, local_;  // per row of the region; per row of a band and its two neighbours
  std::vector<std::pair<std::size_t, std::size_t>> pairs_;
};

}  // namespace

std::vector<Descriptor> describe_segments(const cv::Mat& grey, std::span<const LineSegment> segments,
                                          const LineDescriptorOptions& options) {
  if (grey.type() != CV_8UC1 || grey.empty()) {
    throw std::invalid_argument("describe_segments: an 8-bit one-channel image is needed");
  }
  if (options.bands < 9 || options.band_width < 1) {
    throw std::invalid_argument("describe_segments: at least nine bands of one row are needed");
  }
  int octaves = 0;
  for (const LineSegment& segment : segments) {
    if (segment.octave < 0) throw std::invalid_argument("describe_segments: octave below 0");
    octaves = std::max(octaves, segment.octave + 1);
  }
  const std::vector<Gradients> gradients = gradient_octaves(grey, octaves);
  const BandLayout layout(options);
  std::vector<Row> rows(layout.rows());
  std::vector<char> seen(layout.rows());
  std::vector<Descriptor> descriptors;
  descriptors.reserve(segments.size());
  for (const LineSegment& segment : segments) {
    const Support support(segment);
    for (std::size_t r = 0; r < rows.size(); ++r) {
      seen[r] =
          row_means(gradients[static_cast<std::size_t>(segment.octave)], support, layout.offset(r), rows[r]);
    }
    descriptors.push_back(layout.describe(rows, seen));
  }
  return descriptors;
}

}  // namespace ipl_slam
