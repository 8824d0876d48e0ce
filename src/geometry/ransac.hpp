#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace ipl_slam {

struct RansacOptions {
  double threshold = 1.0;    ///< largest error of an inlier, in the unit of the estimator's error
  double confidence = 0.99;  ///< probability in (0, 1) that one sample without outliers was among those drawn
  int max_iterations = 1000;  ///< samples drawn at most
  int min_inliers = 0;        ///< a model with fewer is no result; never less than the sample size
};

template <class Model>
struct RansacResult {
  Model model;
  std::vector<std::uint32_t> inliers;  ///< ascending indices
  double score = 0.0;                  ///< sum of min(error^2, threshold^2) over all data; smaller is better
  int iterations = 0;                  ///< samples drawn
};

/// What ransac() fits:
///   using Model = ...;
///   static constexpr std::size_t kSampleSize = ...;                        // data one model needs
///   std::size_t size() const;                                              // number of data
///   std::optional<Model> fit(std::span<const std::uint32_t>) const;        // from kSampleSize or more data
///   double squared_error(const Model&, std::uint32_t index) const;
template <class E>
concept RansacEstimator = requires(const E& e, std::span<const std::uint32_t> indices,
                                   const typename E::Model& model) {
  { E::kSampleSize } -> std::convertible_to<std::size_t>;
  { e.size() } -> std::convertible_to<std::size_t>;
  { e.fit(indices) } -> std::same_as<std::optional<typename E::Model>>;
  { e.squared_error(model, std::uint32_t{}) } -> std::convertible_to<double>;
};

/// Where the samples come from: a seeded generator whose index(n) is uniform in [0, n).
template <class R>
concept RandomIndexSource = requires(R& random) {
  { random.index(std::uint64_t{}) } -> std::convertible_to<std::uint64_t>;
};

namespace ransac_detail {

template <std::size_t N, RandomIndexSource Random>
std::array<std::uint32_t, N> draw_distinct(std::uint32_t n, Random& random) {
  std::array<std::uint32_t, N> sample{};
  for (auto it = sample.begin(); it != sample.end();) {
    *it = static_cast<std::uint32_t>(random.index(n));
    if (std::find(sample.begin(), it, *it) == it) ++it;
  }
  return sample;
}

// Samples needed so that one of them is free of outliers with the wished confidence (Fischler and Bolles
// 1981).
inline double iterations_needed(double inlier_share, std::size_t sample_size, double confidence) {
  const double good = std::pow(inlier_share, static_cast<double>(sample_size));
  if (good >= 1.0 - 1e-12) return 1.0;
  return good < 1e-12 ? 1e12 : std::log(1.0 - confidence) / std::log(1.0 - good);
}

template <RansacEstimator E>
RansacResult<typename E::Model> score(const E& estimator, typename E::Model model, double threshold) {
  RansacResult<typename E::Model> result{.model = std::move(model), .inliers = {}};
  const double limit = threshold * threshold;
  for (std::uint32_t i = 0; i < estimator.size(); ++i) {
    const double error = estimator.squared_error(result.model, i);
    if (error <= limit) {
      result.score += error;
      result.inliers.push_back(i);
    } else {
      result.score += limit;  // also where the error is not a number
    }
  }
  return result;
}

}  // namespace ransac_detail

/// Robust fit by random samples (RANSAC, Fischler and Bolles 1981) with the score of MSAC (Torr and Zisserman
/// 2000); the number of samples adapts to the share of inliers found, and the winner is fitted again to all
/// its inliers. The result depends on the data and on the state of `random` (64-bit uniform random bit
/// generator) alone. Nothing is returned where the data are too few or no sample gives a model with enough
/// inliers.
template <RansacEstimator E, RandomIndexSource Random>
[[nodiscard]] std::optional<RansacResult<typename E::Model>> ransac(const E& estimator,
                                                                    const RansacOptions& options,
                                                                    Random& random) {
  constexpr std::size_t kSample = E::kSampleSize;
  using Result = RansacResult<typename E::Model>;
  if (estimator.size() < kSample) return std::nullopt;
  const auto size = static_cast<std::uint32_t>(estimator.size());

  std::optional<Result> best;
  const auto keep_if_better = [&](std::optional<typename E::Model> model) {
    if (!model) return false;
    Result result = ransac_detail::score(estimator, std::move(*model), options.threshold);
    if (best && result.score >= best->score) return false;
    best = std::move(result);
    return true;
  };

  double needed = options.max_iterations;
  int iterations = 0;
  for (; iterations < options.max_iterations && iterations < needed; ++iterations) {
    const auto sample = ransac_detail::draw_distinct<kSample>(size, random);
    if (!keep_if_better(estimator.fit(sample))) continue;
    needed = ransac_detail::iterations_needed(static_cast<double>(best->inliers.size()) / size, kSample,
                                              options.confidence);
  }
  // A sample's model carries the noise of its few data; the fit to all inliers averages it, and may win more
  // of them.
  while (best && best->inliers.size() >= kSample && keep_if_better(estimator.fit(best->inliers))) {
  }
  const auto required =
      std::max<std::size_t>(kSample, static_cast<std::size_t>(std::max(0, options.min_inliers)));
  if (!best || best->inliers.size() < required) return std::nullopt;
  best->iterations = iterations;
  return best;
}

}  // namespace ipl_slam
