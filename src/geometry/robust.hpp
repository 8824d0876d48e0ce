#pragma once

#include <cmath>

namespace ipl_slam {

/// 95 % points of the chi-square distribution: a correct residual, squared and divided by its variance,
/// exceeds the value of its number of components in one case out of twenty.
inline constexpr double kChi2For2Dof = 5.991;
inline constexpr double kChi2For3Dof = 7.815;
inline constexpr double kChi2For4Dof = 9.488;

/// The same by the number of components, 2 to 4.
[[nodiscard]] constexpr double chi2_threshold(int components) {
  return components <= 2 ? kChi2For2Dof : components == 3 ? kChi2For3Dof : kChi2For4Dof;
}

/// Huber's robust cost of a squared error s >= 0: s up to delta^2, growing with sqrt(s) beyond
/// (Huber, "Robust estimation of a location parameter", 1964). Units: those of s; delta those of its root.
[[nodiscard]] inline double huber_cost(double s, double delta) {
  return s <= delta * delta ? s : 2.0 * delta * std::sqrt(s) - delta * delta;
}

/// Derivative of huber_cost with respect to s: the factor by which a residual's weight shrinks, in (0, 1].
[[nodiscard]] inline double huber_weight(double s, double delta) {
  return s <= delta * delta ? 1.0 : delta / std::sqrt(s);
}

}  // namespace ipl_slam
