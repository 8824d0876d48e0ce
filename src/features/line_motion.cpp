#include "features/line_motion.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>

#include <Eigen/Cholesky>

#include "common/random.hpp"
#include "geometry/line3.hpp"
#include "geometry/ransac.hpp"

namespace ipl_slam {
namespace {

constexpr std::uint64_t kSeed = 4;
constexpr RansacOptions kSampling{.threshold = 0.0, .confidence = 0.999, .max_iterations = 500};

// What motions are expected between keyframes, standard deviations. They count only where lines leave the
// motion open.
constexpr double kTurnOrScale = 0.2;  // rad, and scale - 1
constexpr double kShift = 100.0;      // pixels

/// Unknowns (s, r, t): x' = x + [s -r; r s] (x - centre) + t.
class MotionEstimator {
 public:
  using Model = Eigen::Vector4d;
  static constexpr std::size_t kSampleSize = 2;

  MotionEstimator(std::span<const LineSegment> a, std::span<const LineSegment> b,
                  std::span<const std::pair<int, int>> pairs, double sigma)
      : inverse_variance_(1.0 / (sigma * sigma)) {
    for (const auto& [i, j] : pairs) {
      const LineSegment& from = a[static_cast<std::size_t>(i)];
      const LineSegment& to = b[static_cast<std::size_t>(j)];
      const auto line = image_line(to.start.cast<double>(), to.end.cast<double>());
      if (!line) continue;
      data_.push_back({from.start.cast<double>(), from.end.cast<double>(), *line});
      centre_ += 0.5 * (data_.back().start + data_.back().end);
    }
    if (!data_.empty()) centre_ /= static_cast<double>(data_.size());
  }

  [[nodiscard]] std::size_t size() const { return data_.size(); }

  [[nodiscard]] std::optional<Model> fit(std::span<const std::uint32_t> indices) const {
    Eigen::Matrix4d H =
        Eigen::Vector4d(1.0 / (kTurnOrScale * kTurnOrScale), 1.0 / (kTurnOrScale * kTurnOrScale),
                        1.0 / (kShift * kShift), 1.0 / (kShift * kShift))
            .asDiagonal();
    Eigen::Vector4d g = Eigen::Vector4d::Zero();
    for (const std::uint32_t i : indices) {
      for (const Eigen::Vector2d& x : {data_[i].start, data_[i].end}) {
        const Eigen::Vector4d row = derivative(x, data_[i].line);
        H += inverse_variance_ * row * row.transpose();
        g -= inverse_variance_ * signed_distance(data_[i].line, x) * row;
      }
    }
    return Model(H.ldlt().solve(g));
  }

  [[nodiscard]] double squared_error(const Model& model, std::uint32_t i) const {
    double worst = 0.0;
    for (const Eigen::Vector2d& x : {data_[i].start, data_[i].end}) {
      const double e = signed_distance(data_[i].line, x) + derivative(x, data_[i].line).dot(model);
      worst = std::max(worst, e * e);
    }
    return worst;
  }

  [[nodiscard]] ImageMotion motion(const Model& m) const {
    ImageMotion result;
    result.A << 1.0 + m[0], -m[1], m[1], 1.0 + m[0];
    result.t = centre_ - result.A * centre_ + m.tail<2>();
    return result;
  }

 private:
  struct Datum {
    Eigen::Vector2d start, end;  // of a's segment
    ImageLine line;              // of b's
  };

  // Of the distance to the line, with respect to the unknowns.
  [[nodiscard]] Eigen::Vector4d derivative(const Eigen::Vector2d& x, const ImageLine& line) const {
    const Eigen::Vector2d d = x - centre_;
    return {line.x() * d.x() + line.y() * d.y(), line.y() * d.x() - line.x() * d.y(), line.x(), line.y()};
  }

  double inverse_variance_;
  std::vector<Datum> data_;
  Eigen::Vector2d centre_ = Eigen::Vector2d::Zero();
};

}  // namespace

ImageMotion common_motion(std::span<const LineSegment> a, std::span<const LineSegment> b,
                          std::span<const std::pair<int, int>> pairs, double threshold) {
  const MotionEstimator estimator(a, b, pairs, threshold);
  RansacOptions options = kSampling;
  options.threshold = threshold;
  Random random(kSeed);
  const auto found = ransac(estimator, options, random);
  return found ? estimator.motion(found->model) : ImageMotion{};
}

}  // namespace ipl_slam
