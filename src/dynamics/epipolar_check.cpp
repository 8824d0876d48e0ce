#include "dynamics/epipolar_check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

#include "common/median.hpp"
#include "common/random.hpp"
#include "geometry/ransac.hpp"

namespace ipl_slam {
namespace {

// No image is this large; squares and products of such numbers stay far from overflow.
constexpr double kLargestPixel = 1e6;
// A correct error exceeds 1.96 standard deviations in one case out of twenty.
constexpr double kDeviationsAllowed = 1.96;
// Median of the absolute value of a normal error, times this, is its standard deviation.
constexpr double kDeviationPerMedian = 1.4826;
// 95 % point of the chi-square distribution with 2 degrees of freedom: a homography's error has two
// components.
constexpr double kHomographyChi2 = 5.991;
// A homography that has a chance by GRIC explains four pairs of five: 9 samples find it with 99 %. Noise
// makes many a sample useless.
constexpr int kHomographySamples = 50;

using Indices = std::span<const std::uint32_t>;

bool is_pixel(const Eigen::Vector2d& p) {
  return p.allFinite() && p.cwiseAbs().maxCoeff() < kLargestPixel;
}

// The right null vector of a matrix with one row less than columns, handed over transposed.
template <int kColumns>
Eigen::Matrix<double, kColumns, 1> null_vector(
    const Eigen::Matrix<double, kColumns, kColumns - 1>& transposed) {
  using Vector = Eigen::Matrix<double, kColumns, 1>;
  const Eigen::HouseholderQR<Eigen::Matrix<double, kColumns, kColumns - 1>> qr(transposed);
  return qr.householderQ() * Vector(Vector::Unit(kColumns - 1));
}

// The unit vector h with the smallest |A h|, from the normal matrix A^T A.
Eigen::Matrix<double, 9, 1> smallest_eigenvector(const Eigen::Matrix<double, 9, 9>& normal) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>>(normal).eigenvectors().col(0);
}

Eigen::Matrix3d row_wise(const Eigen::Matrix<double, 9, 1>& v) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(v.data());
}

/// Pixels moved to mean 0 and scaled to a mean distance of sqrt(2) from it, one scale for both frames
/// (Hartley 1997), which keeps the ratio of errors in the two.
struct NormalizedPairs {
  std::vector<PixelPair> pairs;
  Eigen::Vector2d mean_before = Eigen::Vector2d::Zero(), mean_now = Eigen::Vector2d::Zero();
  double scale = 0.0;  // normalised units per pixel; 0 where all points are one

  explicit NormalizedPairs(std::vector<PixelPair> pixels) : pairs(std::move(pixels)) {
    const auto n = static_cast<double>(pairs.size());
    for (const PixelPair& p : pairs) mean_before += p.before / n, mean_now += p.now / n;
    double distance = 0.0;
    for (const PixelPair& p : pairs) {
      distance += (p.before - mean_before).norm() + (p.now - mean_now).norm();
    }
    distance /= 2.0 * n;
    if (!(distance > std::numeric_limits<float>::epsilon())) return;
    scale = std::numbers::sqrt2 / distance;
    for (PixelPair& p : pairs) {
      p.before = scale * (p.before - mean_before), p.now = scale * (p.now - mean_now);
    }
  }

  [[nodiscard]] Eigen::Matrix3d normalization(const Eigen::Vector2d& mean) const {
    Eigen::Matrix3d T = Eigen::Matrix3d::Identity();
    T.topLeftCorner<2, 2>() *= scale;
    T.topRightCorner<2, 1>() = -scale * mean;
    return T;
  }

  /// F for pixels, of norm 1, from that for the normalised ones.
  [[nodiscard]] Eigen::Matrix3d in_pixels(const Eigen::Matrix3d& F) const {
    return (normalization(mean_now).transpose() * F * normalization(mean_before)).normalized();
  }
};

/// Eight-point algorithm and Sampson's distance.
class FundamentalEstimator {
 public:
  using Model = Eigen::Matrix3d;
  static constexpr std::size_t kSampleSize = 8;

  explicit FundamentalEstimator(std::span<const PixelPair> pairs) : pairs_(pairs) {}

  [[nodiscard]] std::size_t size() const { return pairs_.size(); }

  [[nodiscard]] std::optional<Model> fit(Indices indices) const {
    return of_rank_two(row_wise(indices.size() == kSampleSize ? fit_sample(indices) : fit_all(indices)));
  }

  [[nodiscard]] double squared_error(const Model& F, std::uint32_t i) const {
    const Eigen::Vector3d x = pairs_[i].before.homogeneous(), y = pairs_[i].now.homogeneous();
    const Eigen::Vector3d line_now = F * x;
    const Eigen::Vector2d line_before = F.transpose().topRows<2>() * y;
    const double e = y.dot(line_now);
    return e * e / (line_now.head<2>().squaredNorm() + line_before.squaredNorm());
  }

 private:
  // now^T F before = 0 as an equation for F's entries, row by row.
  [[nodiscard]] Eigen::Matrix<double, 9, 1> equation(std::uint32_t i) const {
    const auto& [x, y] = pairs_[i];
    Eigen::Matrix<double, 9, 1> a;
    a << y.x() * x.x(), y.x() * x.y(), y.x(), y.y() * x.x(), y.y() * x.y(), y.y(), x.x(), x.y(), 1.0;
    return a;
  }

  [[nodiscard]] Eigen::Matrix<double, 9, 1> fit_sample(Indices indices) const {
    Eigen::Matrix<double, 9, 8> A;
    for (int k = 0; k < 8; ++k) A.col(k) = equation(indices[static_cast<std::size_t>(k)]);
    return null_vector<9>(A);
  }

  [[nodiscard]] Eigen::Matrix<double, 9, 1> fit_all(Indices indices) const {
    Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
    for (const std::uint32_t i : indices) {
      const Eigen::Matrix<double, 9, 1> a = equation(i);
      normal.selfadjointView<Eigen::Lower>().rankUpdate(a);
    }
    return smallest_eigenvector(normal);
  }

  // The nearest matrix of rank 2: F less its smallest singular value. That one's right vector is F^T F's
  // first eigenvector.
  [[nodiscard]] static std::optional<Model> of_rank_two(const Eigen::Matrix3d& F) {
    if (!F.allFinite()) return std::nullopt;
    const Eigen::Vector3d epipole =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(F.transpose() * F).eigenvectors().col(0);
    return Model(F - F * epipole * epipole.transpose());
  }

  std::span<const PixelPair> pairs_;
};

/// Direct linear transform and Sampson's distance.
class HomographyEstimator {
 public:
  using Model = Eigen::Matrix3d;
  static constexpr std::size_t kSampleSize = 4;

  explicit HomographyEstimator(std::span<const PixelPair> pairs) : pairs_(pairs) {}

  [[nodiscard]] std::size_t size() const { return pairs_.size(); }

  [[nodiscard]] std::optional<Model> fit(Indices indices) const {
    const Model H = row_wise(indices.size() == kSampleSize ? fit_sample(indices) : fit_all(indices));
    return H.allFinite() ? std::optional<Model>(H) : std::nullopt;
  }

  [[nodiscard]] double squared_error(const Model& H, std::uint32_t i) const {
    const Eigen::Vector3d mapped = H * pairs_[i].before.homogeneous();
    const Eigen::Vector2d image = mapped.hnormalized(), e = pairs_[i].now - image;
    // Both points are measured: the covariance of e is that of the one now plus that of the other, carried.
    const Eigen::Matrix2d A = (H.topLeftCorner<2, 2>() - image * H.bottomLeftCorner<1, 2>()) / mapped.z();
    const Eigen::Matrix2d covariance = A * A.transpose() + Eigen::Matrix2d::Identity();
    return e.dot(covariance.inverse() * e);
  }

 private:
  // Two equations for H's entries, row by row: those of now x (H before) = 0 that hold u and v of now.
  [[nodiscard]] Eigen::Matrix<double, 9, 2> equations(std::uint32_t i) const {
    const Eigen::Vector3d x = pairs_[i].before.homogeneous();
    const Eigen::Vector2d& y = pairs_[i].now;
    Eigen::Matrix<double, 9, 2> a;
    a.col(0) << x, Eigen::Vector3d::Zero(), -y.x() * x;
    a.col(1) << Eigen::Vector3d::Zero(), x, -y.y() * x;
    return a;
  }

  [[nodiscard]] Eigen::Matrix<double, 9, 1> fit_sample(Indices indices) const {
    Eigen::Matrix<double, 9, 8> A;
    for (int k = 0; k < 4; ++k) {
      A.middleCols<2>(2 * k) = equations(indices[static_cast<std::size_t>(k)]);
    }
    return null_vector<9>(A);
  }

  [[nodiscard]] Eigen::Matrix<double, 9, 1> fit_all(Indices indices) const {
    Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
    for (const std::uint32_t i : indices) {
      const Eigen::Matrix<double, 9, 2> a = equations(i);
      normal.selfadjointView<Eigen::Lower>().rankUpdate(a);
    }
    return smallest_eigenvector(normal);
  }

  std::span<const PixelPair> pairs_;
};

/// Standard deviation of the points across the line that fits them best; the smaller one of both frames.
double thinnest_spread(std::span<const PixelPair> pairs, Indices indices) {
  const auto across = [&](const Eigen::Vector2d PixelPair::*pixel) {
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const std::uint32_t i : indices) mean += pairs[i].*pixel;
    mean /= static_cast<double>(indices.size());
    Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
    for (const std::uint32_t i : indices) {
      scatter += (pairs[i].*pixel - mean) * (pairs[i].*pixel - mean).transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(scatter, Eigen::EigenvaluesOnly);
    return std::sqrt(std::max(0.0, solver.eigenvalues()[0]) / static_cast<double>(indices.size()));
  };
  return std::min(across(&PixelPair::before), across(&PixelPair::now));
}

/// A kind of two-view relation as GRIC sees it: the dimension of the set of pairs that fulfil one, and the
/// number of its parameters. A pair has four coordinates.
struct Relation {
  int dimension, parameters;
};
constexpr Relation kFundamental{3, 7}, kHomography{2, 8};

/// GRIC = sum min(e^2 / sigma^2, 2 (4 - d)) + d n log 4 + k log 4n (Torr 1998, with his constants).
template <class Estimator>
double gric(const Estimator& estimator, const typename Estimator::Model& model, Indices indices, double sigma,
            Relation relation) {
  const double cap = 2.0 * (4 - relation.dimension);
  double sum = 0.0;
  for (const std::uint32_t i : indices) {
    const double e2 = estimator.squared_error(model, i) / (sigma * sigma);
    sum += e2 < cap ? e2 : cap;  // also where it is not a number
  }
  const auto n = static_cast<double>(indices.size());
  return sum + relation.dimension * n * std::log(4.0) + relation.parameters * std::log(4.0 * n);
}

/// Noise of a coordinate, from what F leaves of all pairs, half of which may be wrong: the median's scale
/// estimate with its correction for few data (Rousseeuw and Leroy, "Robust regression and outlier detection",
/// 1987). The inliers alone would not do: the threshold has cut off the larger errors.
double noise(const FundamentalEstimator& fundamental, const Eigen::Matrix3d& F) {
  std::vector<double> squares(fundamental.size());
  for (std::uint32_t i = 0; i < squares.size(); ++i) squares[i] = fundamental.squared_error(F, i);
  const double spare = static_cast<double>(squares.size()) - kFundamental.parameters;
  return kDeviationPerMedian * (1.0 + 5.0 / spare) * std::sqrt(median(squares));
}

/// Whether a homography explains the pairs that agree with F as well as F does. `sigma`: noise of a
/// coordinate that is to be allowed for at least.
bool is_homography(std::span<const PixelPair> pairs, const RansacResult<Eigen::Matrix3d>& found, double sigma,
                   Random& random) {
  const FundamentalEstimator fundamental(pairs);
  sigma = std::max(sigma, noise(fundamental, found.model));
  std::vector<PixelPair> agreeing;
  std::vector<std::uint32_t> all;
  for (const std::uint32_t i : found.inliers) {
    all.push_back(static_cast<std::uint32_t>(all.size()));
    agreeing.push_back(pairs[i]);
  }
  const HomographyEstimator homography(agreeing);
  const auto best =
      ransac(homography,
             {.threshold = std::sqrt(kHomographyChi2) * sigma, .max_iterations = kHomographySamples}, random);
  return best && gric(homography, best->model, all, sigma, kHomography) <=
                     gric(fundamental, found.model, found.inliers, sigma, kFundamental);
}

}  // namespace

double epipolar_distance(const Eigen::Matrix3d& F, const PixelPair& pair) {
  const Eigen::Vector3d line = F * pair.before.homogeneous();
  const double distance = std::abs(pair.now.homogeneous().dot(line)) / line.head<2>().norm();
  return std::isfinite(distance) ? distance : 0.0;
}

std::optional<Eigen::Matrix3d> fundamental_matrix(std::span<const PixelPair> pairs,
                                                  const EpipolarCheckOptions& options, std::uint64_t seed) {
  std::vector<PixelPair> pixels;
  std::copy_if(pairs.begin(), pairs.end(), std::back_inserter(pixels),
               [](const PixelPair& p) { return is_pixel(p.before) && is_pixel(p.now); });
  const auto required = std::max<double>(options.min_pairs, FundamentalEstimator::kSampleSize);
  if (static_cast<double>(pixels.size()) < required) return std::nullopt;
  const NormalizedPairs data(std::move(pixels));
  if (data.scale == 0.0) return std::nullopt;

  // The distance from the epipolar line holds the noise of both points, sqrt(2) times that of one, which is
  // what Sampson's distance holds.
  const double threshold = options.threshold / std::numbers::sqrt2 * data.scale;
  const double agreement = options.min_agreement * static_cast<double>(data.pairs.size());
  Random random(seed);
  const auto found = ransac(FundamentalEstimator(data.pairs),
                            {.threshold = threshold,
                             .max_iterations = options.max_samples,
                             .min_inliers = static_cast<int>(std::ceil(std::max(required, agreement)))},
                            random);
  if (!found || !(thinnest_spread(data.pairs, found->inliers) > threshold)) return std::nullopt;
  if (is_homography(data.pairs, *found, threshold / kDeviationsAllowed, random)) return std::nullopt;
  const Eigen::Matrix3d F = data.in_pixels(found->model);
  return F.allFinite() ? std::optional<Eigen::Matrix3d>(F) : std::nullopt;
}

}  // namespace ipl_slam
