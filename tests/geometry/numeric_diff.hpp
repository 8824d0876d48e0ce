#pragma once

#include <Eigen/Core>

namespace ipl_slam::testing {

/// Derivative of f : R^N -> R^M at 0 by central differences with Richardson extrapolation: the error is of
/// order step^4, below 1e-8 of the derivative's scale for the smooth functions of the tests.
template <int M, int N, class F>
Eigen::Matrix<double, M, N> numeric_jacobian(const F& f, double step = 1e-3) {
  Eigen::Matrix<double, M, N> j;
  for (int i = 0; i < N; ++i) {
    const auto slope = [&](double h) -> Eigen::Matrix<double, M, 1> {
      const Eigen::Matrix<double, N, 1> d = h * Eigen::Matrix<double, N, 1>::Unit(i);
      return (f(d) - f(Eigen::Matrix<double, N, 1>(-d))) / (2.0 * h);
    };
    j.col(i) = (4.0 * slope(step / 2) - slope(step)) / 3.0;
  }
  return j;
}

}  // namespace ipl_slam::testing
