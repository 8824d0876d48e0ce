#pragma once

#include "geometry/camera.hpp"

namespace ipl_slam {

/// A line whose image is nearer to a point than this has no residual: the line passes (nearly) through the
/// camera centre, distance in metres.
inline constexpr double kMinLineDistance = 1e-4;

/// The residual of one observed end point against a line, and its derivatives, the project's only statement
/// of them (paper section 3.5):
///
///   e = d(x, l) = x^T l / sqrt(l_1^2 + l_2^2)     pixels, with l = K_line n the projected line
///
/// n and d are moment and direction of the line in the camera frame (geometry/line3.hpp). The projection does
/// not depend on d; the pose does act on n through it: n_c = R n_w + t x d_c.
///
/// S is double, or a vector type of several lines side by side.
template <class S>
struct LineResidual {
  S e;               ///< signed distance, pixels
  S jacobian_n[3];   ///< d e / d n
  S jacobian_xi[6];  ///< d e / d xi for T_cw <- exp(xi) T_cw, xi = (rho, phi)
};

/// What the two end points of one observation share: the projected line and its scale.
template <class S>
struct ProjectedLine {
  S a, b, c;    ///< image line, normal of length 1
  S inverse_w;  ///< 1 / length of the normal before that
};

/// `root` is the square root for S.
template <class S, class Root>
[[gnu::always_inline]] inline void project_moment(const Camera& camera, const S (&n)[3], Root root,
                                                  ProjectedLine<S>& out) {
  const S l1 = camera.fy * n[0], l2 = camera.fx * n[1];
  const S l3 = (camera.fx * camera.fy) * n[2] - camera.cx * l1 - camera.cy * l2;
  out.inverse_w = 1.0 / root(l1 * l1 + l2 * l2);
  out.a = l1 * out.inverse_w, out.b = l2 * out.inverse_w, out.c = l3 * out.inverse_w;
}

/// Residual of the undistorted pixel (u, v).
template <class S>
[[gnu::always_inline]] inline void line_residual(const Camera& camera, const S (&n)[3], const S (&d)[3],
                                                 const ProjectedLine<S>& l, const S& u, const S& v,
                                                 LineResidual<S>& out) {
  out.e = l.a * u + l.b * v + l.c;
  // d e / d l = (x - e (a, b, 0)) / w, then through K_line.
  const S g1 = (u - out.e * l.a) * l.inverse_w, g2 = (v - out.e * l.b) * l.inverse_w, g3 = l.inverse_w;
  S(&g)[3] = out.jacobian_n;
  g[0] = camera.fy * (g1 - camera.cx * g3);
  g[1] = camera.fx * (g2 - camera.cy * g3);
  g[2] = (camera.fx * camera.fy) * g3;
  // n <- n + rho x d + phi x n, so the rows are d x g and n x g.
  S(&j)[6] = out.jacobian_xi;
  j[0] = d[1] * g[2] - d[2] * g[1], j[1] = d[2] * g[0] - d[0] * g[2], j[2] = d[0] * g[1] - d[1] * g[0];
  j[3] = n[1] * g[2] - n[2] * g[1], j[4] = n[2] * g[0] - n[0] * g[2], j[5] = n[0] * g[1] - n[1] * g[0];
}

}  // namespace ipl_slam
