#include "geometry/perspective_three_point.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace ipl_slam {
namespace {

// Points nearer to each other than this, or further than the inverse, m, pose no sensible problem.
constexpr double kMinSide = 1e-6;
// A double root splits under rounding into a pair with small imaginary parts, of about the square root of a
// double's precision, relative to its size.
constexpr double kRealRoot = 1e-6;
constexpr int kNewtonSteps = 5;     // quadratic convergence from a root that is good to a few digits
constexpr double kResidual = 1e-6;  // of the laws of cosines, relative to the longest side squared

// Real roots of a4 v^4 + ... + a0, ascending: eigenvalues of the companion matrix.
std::vector<double> real_roots(const std::array<double, 5>& a) {
  Eigen::Matrix4d companion = Eigen::Matrix4d::Zero();
  companion.diagonal<-1>().setOnes();
  for (int i = 0; i < 4; ++i) companion(i, 3) = -a[i] / a[4];
  if (!companion.allFinite()) return {};
  std::vector<double> roots;
  for (const std::complex<double>& root : companion.eigenvalues()) {
    if (std::abs(root.imag()) <= kRealRoot * std::max(1.0, std::abs(root.real())))
      roots.push_back(root.real());
  }
  std::sort(roots.begin(), roots.end());
  return roots;
}

// The triangle that camera centre and points span, in the names of Haralick et al.: side a is opposite to
// point 1, and so on; alpha is the angle between the rays to points 2 and 3, and so on.
struct Triangle {
  double a2, b2, c2;  // squared sides, m^2
  double cos_alpha, cos_beta, cos_gamma;

  // What the laws of cosines leave over.
  [[nodiscard]] Eigen::Vector3d residual(const Eigen::Vector3d& s) const {
    return {s[1] * s[1] + s[2] * s[2] - 2.0 * s[1] * s[2] * cos_alpha - a2,
            s[0] * s[0] + s[2] * s[2] - 2.0 * s[0] * s[2] * cos_beta - b2,
            s[0] * s[0] + s[1] * s[1] - 2.0 * s[0] * s[1] * cos_gamma - c2};
  }
  [[nodiscard]] Eigen::Matrix3d derivative(const Eigen::Vector3d& s) const {
    Eigen::Matrix3d d;
    d << 0.0, s[1] - s[2] * cos_alpha, s[2] - s[1] * cos_alpha,  //
        s[0] - s[2] * cos_beta, 0.0, s[2] - s[0] * cos_beta,     //
        s[0] - s[1] * cos_gamma, s[1] - s[0] * cos_gamma, 0.0;
    return 2.0 * d;
  }

  // Grunert's quartic in v = s3 / s1, a0 to a4.
  [[nodiscard]] std::array<double, 5> quartic() const {
    const double q = (a2 - c2) / b2, sum = (a2 + c2) / b2, a = a2 / b2, c = c2 / b2;
    const double ca = cos_alpha, cb = cos_beta, cg = cos_gamma;
    return {(1.0 + q) * (1.0 + q) - 4.0 * a * cg * cg,
            4.0 * (-q * (1.0 + q) * cb + 2.0 * a * cg * cg * cb - (1.0 - sum) * ca * cg),
            2.0 * (q * q - 1.0 + 2.0 * q * q * cb * cb + 2.0 * (1.0 - c) * ca * ca -
                   4.0 * sum * ca * cb * cg + 2.0 * (1.0 - a) * cg * cg),
            4.0 * (q * (1.0 - q) * cb - (1.0 - sum) * ca * cg + 2.0 * c * ca * ca * cb),
            (q - 1.0) * (q - 1.0) - 4.0 * c * ca * ca};
  }
  // The distances that belong to a root of the quartic.
  [[nodiscard]] Eigen::Vector3d distances(double v) const {
    const double q = (a2 - c2) / b2;
    const double u =
        ((q - 1.0) * v * v - 2.0 * q * cos_beta * v + 1.0 + q) / (2.0 * (cos_gamma - v * cos_alpha));
    const double s1 = std::sqrt(b2 / (1.0 + v * v - 2.0 * v * cos_beta));
    return {s1, u * s1, v * s1};
  }
};

}  // namespace

std::vector<Eigen::Vector3d> three_point_distances(const std::array<Eigen::Vector3d, 3>& points,
                                                   const std::array<Eigen::Vector3d, 3>& rays) {
  const Triangle triangle{(points[1] - points[2]).squaredNorm(),
                          (points[0] - points[2]).squaredNorm(),
                          (points[0] - points[1]).squaredNorm(),
                          rays[1].dot(rays[2]),
                          rays[0].dot(rays[2]),
                          rays[0].dot(rays[1])};
  const double shortest = std::min({triangle.a2, triangle.b2, triangle.c2});
  const double longest = std::max({triangle.a2, triangle.b2, triangle.c2});
  if (!(shortest > kMinSide * kMinSide) || !std::isfinite(longest)) return {};

  std::vector<Eigen::Vector3d> solutions;
  for (const double v : real_roots(triangle.quartic())) {
    Eigen::Vector3d s = triangle.distances(v);
    for (int step = 0; step < kNewtonSteps && s.allFinite(); ++step) {
      s -= triangle.derivative(s).partialPivLu().solve(triangle.residual(s));
    }
    // Also turns away numbers that are none.
    const bool solved = triangle.residual(s).cwiseAbs().maxCoeff() <= kResidual * longest;
    if (solved && (s.array() > 0.0).all()) solutions.push_back(s);
  }
  return solutions;
}

}  // namespace ipl_slam
