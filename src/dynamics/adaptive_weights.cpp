#include "dynamics/adaptive_weights.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ipl_slam {
namespace {

bool is_known(const std::optional<double>& distance) {
  return distance && std::isfinite(*distance) && *distance >= 0.0;
}

double drop_small(double weight, double min_weight) {
  return weight < min_weight ? 0.0 : weight;
}

}  // namespace

std::vector<double> point_weights(std::span<const std::optional<double>> distances, double min_weight) {
  double d_min = std::numeric_limits<double>::infinity(), d_max = 0.0;
  for (const std::optional<double>& d : distances) {
    if (is_known(d)) d_min = std::min(d_min, *d), d_max = std::max(d_max, *d);
  }
  std::vector<double> weights(distances.size(), 1.0);
  if (!(d_max > d_min)) return weights;
  for (std::size_t i = 0; i < distances.size(); ++i) {
    const std::optional<double>& d = distances[i];
    if (is_known(d)) weights[i] = drop_small((d_max - *d) / (d_max - d_min), min_weight);
  }
  return weights;
}

double residual_weight(double chi2, int components, double max_chi2, double min_weight) {
  const double d = std::sqrt(chi2 / components), d_max = std::sqrt(max_chi2 / components);
  if (d >= d_max) return 0.0;
  return d <= 1.0 ? 1.0 : drop_small((d_max - d) / (d_max - 1.0), min_weight);
}

double line_weight(std::optional<double> angle, double min_weight) {
  if (!angle || !std::isfinite(*angle)) return 1.0;
  return drop_small(std::max(0.0, std::cos(*angle)), min_weight);
}

}  // namespace ipl_slam
