#include "tracking/line_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "geometry/line3.hpp"

namespace ipl_slam {
namespace {

constexpr int kMaxRadius = 40;  // px; a prediction that is worse than that needs another way
constexpr int kMinSamples = 4;  // two fix a line, two more say whether it is one
constexpr int kMaxSamples = 64;
constexpr int kMaxEdges = 6;        // per sample; more than that is texture
constexpr double kTolerance = 1.0;  // px; a blurred, noisy edge is found to some 0.3

// An edge on the normal of a sample.
struct Edge {
  float along;       // where its sample lies: -1 at the start of the expected line, 1 at its end
  float offset;      // px along the normal
  float contrast;    // grey values
  float similarity;  // of the contrast to the expected one, in (0, 1]
  int sample;
};

// The edges of all samples, sample by sample.
struct Edges {
  std::array<Edge, kMaxSamples * kMaxEdges> list;
  int count = 0;
  int samples = 0;  // how many could be looked at

  [[nodiscard]] std::span<const Edge> all() const { return {list.data(), static_cast<std::size_t>(count)}; }
};

// Grey values along a normal, one per undistorted pixel. The lens bends it into very nearly a parabola.
class Profile {
 public:
  static constexpr int kReach = 2;  // pixels that the derivative averages on either side
  static constexpr int kMaxSize = 2 * (kMaxRadius + 1 + kReach);

  // Reads 2 (radius + 1 + kReach) values, the middle of which lies between the two about `centre`. False
  // where they leave the image.
  bool read(const Camera& camera, const cv::Mat& grey, const Eigen::Vector2d& centre,
            const Eigen::Vector2d& normal, int radius) {
    size_ = 2 * (radius + 1 + kReach);
    const double half = 0.5 * (size_ - 1);
    const Eigen::Vector2d first = camera.distort(centre - half * normal), middle = camera.distort(centre),
                          last = camera.distort(centre + half * normal);
    // The parabola stays in the triangle of its control points.
    const Eigen::Vector2d control = 2.0 * middle - 0.5 * (first + last);
    for (const Eigen::Vector2d& p : {first, control, last})
      if (!(p.x() >= 1.0 && p.y() >= 1.0 && p.x() < grey.cols - 2 && p.y() < grey.rows - 2)) return false;
    const Eigen::Vector2d bend = (first + last - 2.0 * middle) / (2.0 * half * half);
    const Eigen::Vector2d step = (last - first) / (2.0 * half) + (1.0 - 2.0 * half) * bend;
    const Walk x(first.x(), step.x(), bend.x()), y(first.y(), step.y(), bend.y());
    sample(grey, x, y);
    return true;
  }

  // How fast the grey value rises at position i = 0 .. 2 (radius + 1): mean of the two values after it less
  // that of the two before.
  [[nodiscard]] float slope(int i) const {
    return kScale * static_cast<float>(values_[i + 2] + values_[i + 3] - values_[i] - values_[i + 1]);
  }
  // Step from 2 px before position i = 1 .. 2 radius + 1 to 2 px after it, as the line detector measures it.
  [[nodiscard]] float step(int i) const {
    return kScale * static_cast<float>(values_[i + 3] + values_[i + 4] - values_[i] - values_[i - 1]);
  }

 private:
  static constexpr float kScale = 0.5F / 65536.0F;

  // A quadratic sequence in 16.16 fixed point: value, first and second difference.
  struct Walk {
    int value, step, bend;
    Walk(double v, double s, double b) : value(fixed(v)), step(fixed(s)), bend(fixed(2.0 * b)) {}
    static int fixed(double v) { return static_cast<int>(std::lround(v * 65536.0)); }
    void advance() { value += step, step += bend; }
  };

  void sample(const cv::Mat& grey, Walk x, Walk y) {
    const std::uint8_t* pixels = grey.data;
    const auto row = static_cast<std::ptrdiff_t>(grey.step);
    for (int i = 0; i < size_; ++i, x.advance(), y.advance()) {
      const std::uint8_t* p = pixels + (y.value >> 16) * row + (x.value >> 16);
      const int u = (x.value >> 8) & 255, v = (y.value >> 8) & 255;
      const int upper = p[0] * (256 - u) + p[1] * u, lower = p[row] * (256 - u) + p[row + 1] * u;
      values_[i] = upper * (256 - v) + lower * v;
    }
  }

  int size_ = 0;
  std::array<int, kMaxSize> values_;  // 16.16
};

// How the step of an edge is judged against the one expected.
class ContrastGate {
 public:
  ContrastGate(float expected, const LineSearchOptions& o)
      : expected_(expected),
        ratio_(static_cast<float>(o.contrast_ratio)),
        low_(static_cast<float>(o.min_contrast)) {
    if (!known()) return;
    low_ = std::max(low_, expected / (ratio_ * ratio_));
    high_ = expected * (ratio_ * ratio_);
  }

  [[nodiscard]] float low() const { return low_; }
  // A single sample may differ by the square of what the whole line may: it is noisy, and edges that are out
  // of the question still count when it comes to ambiguity.
  [[nodiscard]] bool admits(float contrast) const { return contrast >= low_ && contrast <= high_; }
  [[nodiscard]] bool admits_line(float mean) const { return similarity(mean) * ratio_ >= 1.0F; }
  [[nodiscard]] float similarity(float contrast) const {
    return known() ? std::min(contrast / expected_, expected_ / contrast) : 1.0F;
  }

 private:
  [[nodiscard]] bool known() const { return expected_ > 0.0F; }

  float expected_, ratio_, low_, high_ = 255.0F;
};

// Adds the profile's edges: peaks of the slope, placed by a parabola through three values.
void add_edges(const Profile& profile, int radius, float along, const ContrastGate& gate, Edges& edges) {
  const int first = edges.count;
  float before = profile.slope(0), here = profile.slope(1);
  for (int i = 1; i <= 2 * radius + 1; ++i) {
    const float after = profile.slope(i + 1);
    const float contrast = profile.step(i);
    // An even slope, such as shading, rises half as much within half the way.
    if (here > before && here >= after && 2.0F * here >= gate.low() && gate.admits(contrast)) {
      const float peak = 0.5F * (before - after) / (before - 2.0F * here + after);
      const Edge edge{along, static_cast<float>(i - radius - 1) + peak, contrast, gate.similarity(contrast),
                      edges.samples};
      if (edges.count - first < kMaxEdges) {
        edges.list[edges.count++] = edge;
      } else {
        const auto weakest =
            std::min_element(edges.list.begin() + first, edges.list.begin() + edges.count,
                             [](const Edge& a, const Edge& b) { return a.similarity < b.similarity; });
        if (weakest->similarity < edge.similarity) *weakest = edge;
      }
    }
    before = here, here = after;
  }
  ++edges.samples;
}

// A straight line beside the expected one: offset at its middle and what is added towards its end, px.
struct Offset {
  float middle = 0.0F, tilt = 0.0F;

  [[nodiscard]] float residual(const Edge& e) const { return e.offset - middle - tilt * e.along; }
};

// The offset that most edges agree on, to about half a pixel at either end: a Hough transform in steps of a
// pixel, where each edge gives its similarity to the two nearest bins.
Offset vote(std::span<const Edge> edges, int radius, int max_tilt) {
  constexpr int kMargin = 1;
  Offset best;
  float most = -1.0F;
  for (int tilt = -max_tilt; tilt <= max_tilt; ++tilt) {
    std::array<float, 4 * kMaxRadius + 4> bins;  // |offset - tilt x along| <= 2 radius
    const int reach = radius + max_tilt + kMargin;
    std::fill_n(bins.begin(), 2 * reach + 2, 0.0F);
    for (const Edge& e : edges) {
      const float place = e.offset - static_cast<float>(tilt) * e.along + static_cast<float>(reach);
      const int bin = static_cast<int>(place);
      const float share = (place - static_cast<float>(bin)) * e.similarity;
      bins[bin] += e.similarity - share;
      bins[bin + 1] += share;
    }
    const auto peak = std::max_element(bins.begin(), bins.begin() + 2 * reach + 2);
    if (*peak > most) {
      most = *peak;
      best = {static_cast<float>(peak - bins.begin() - reach), static_cast<float>(tilt)};
    }
  }
  return best;
}

// The edges that agree with a line, at most one per sample.
struct Agreement {
  std::array<Edge, kMaxSamples> edges;
  int count = 0;
  float support = 0.0F;  // sum of their similarities

  Agreement(std::span<const Edge> all, const Offset& line, float tolerance) {
    for (std::size_t i = 0; i < all.size();) {
      const int sample = all[i].sample;
      const Edge* nearest = nullptr;
      float distance = tolerance;
      for (; i < all.size() && all[i].sample == sample; ++i) {
        const float d = std::abs(line.residual(all[i]));
        if (d < distance) distance = d, nearest = &all[i];
      }
      if (nearest == nullptr) continue;
      edges[count++] = *nearest;
      support += nearest->similarity;
    }
  }

  // Least squares; the line of before where one sample alone agrees.
  [[nodiscard]] Offset fit(const Offset& before) const {
    float s_a = 0.0F, s_o = 0.0F, s_aa = 0.0F, s_ao = 0.0F;
    for (int i = 0; i < count; ++i) {
      const Edge& e = edges[i];
      s_a += e.along, s_o += e.offset, s_aa += e.along * e.along, s_ao += e.along * e.offset;
    }
    const auto n = static_cast<float>(count);
    const float det = n * s_aa - s_a * s_a;
    if (!(det > 1e-4F)) return before;
    const float tilt = (n * s_ao - s_a * s_o) / det;
    return {(s_o - tilt * s_a) / n, tilt};
  }

  // Mean square distance from a line, with the two degrees of freedom of a fit taken off.
  [[nodiscard]] float variance(const Offset& line) const {
    float sum = 0.0F;
    for (int i = 0; i < count; ++i) sum += line.residual(edges[i]) * line.residual(edges[i]);
    return sum / static_cast<float>(std::max(1, count - 2));
  }

  [[nodiscard]] float mean_contrast() const {
    float sum = 0.0F;
    for (int i = 0; i < count; ++i) sum += edges[i].contrast;
    return sum / static_cast<float>(count);
  }
};

// The straight line with the most agreement.
struct Candidate {
  Offset line;
  Agreement agreement;

  Candidate(std::span<const Edge> edges, int radius, int max_tilt)
      : line(vote(edges, radius, max_tilt)), agreement(edges, line, 1.5F * kTolerance) {
    for (int i = 0; i < 2; ++i) {
      line = agreement.fit(line);
      agreement = Agreement(edges, line, kTolerance);
    }
  }
};

// Whether the edges that the best line leaves over make up another one that is nearly as good.
bool ambiguous(const Edges& edges, const Candidate& best, int radius, int max_tilt, double ratio) {
  Edges rest;
  float left = 0.0F;
  for (const Edge& e : edges.all()) {
    if (std::abs(best.line.residual(e)) < kTolerance) continue;
    rest.list[rest.count++] = e;
    left += e.similarity;
  }
  const float limit = static_cast<float>(ratio) * best.agreement.support;
  return left > limit && Candidate(rest.all(), radius, max_tilt).agreement.support > limit;
}

}  // namespace

LineSearch::LineSearch(const Camera& camera, const LineSearchOptions& options)
    : camera_(camera), options_(options) {}

std::optional<FoundLine> LineSearch::find(const cv::Mat& grey, const ExpectedLine& expected,
                                          double radius) const {
  CV_Assert(grey.type() == CV_8UC1);
  const std::optional<ImageLine> axis = image_line(expected.start, expected.end);
  if (!axis || !(radius >= 1.0)) return std::nullopt;
  const Eigen::Vector2d normal = axis->head<2>(), middle = 0.5 * (expected.start + expected.end),
                        half = 0.5 * (expected.end - expected.start);
  const double length = 2.0 * half.norm();
  const int samples =
      static_cast<int>(std::min<double>(options_.max_samples, 1.0 + length / options_.spacing));
  if (samples < kMinSamples) return std::nullopt;

  const int reach = static_cast<int>(std::ceil(std::min<double>(radius, kMaxRadius)));
  const ContrastGate gate(expected.contrast, options_);
  Edges edges;
  Profile profile;
  for (int i = 0; i < samples; ++i) {
    const double along = 2.0 * i / (samples - 1) - 1.0;
    if (profile.read(camera_, grey, middle + along * half, normal, reach))
      add_edges(profile, reach, static_cast<float>(along), gate, edges);
  }
  if (edges.samples < kMinSamples) return std::nullopt;

  const int max_tilt = static_cast<int>(std::min<double>(reach, std::ceil(0.5 * length * options_.max_tilt)));
  const Candidate best(edges.all(), reach, max_tilt);
  const Agreement& found = best.agreement;
  const double variance = found.variance(best.line);
  const bool convincing = found.count >= kMinSamples && found.count >= options_.min_found * edges.samples &&
                          variance <= options_.max_spread * options_.max_spread &&
                          gate.admits_line(found.mean_contrast()) &&
                          std::abs(best.line.middle) + std::abs(best.line.tilt) <= reach + kTolerance;
  if (!convincing || ambiguous(edges, best, reach, max_tilt, options_.ambiguity)) return std::nullopt;

  const auto at = [&](double along) -> Eigen::Vector2d {
    return middle + along * half + (best.line.middle + best.line.tilt * along) * normal;
  };
  // A straight line fitted to n samples spread evenly is known at its ends to 4 / n of a sample's variance.
  const double sigma2 = options_.sigma * options_.sigma + 4.0 * variance / found.count;
  return FoundLine{at(found.edges[0].along), at(found.edges[found.count - 1].along), found.mean_contrast(),
                   sigma2};
}

}  // namespace ipl_slam
