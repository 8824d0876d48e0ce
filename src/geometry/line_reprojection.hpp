#pragma once

#include "geometry/camera.hpp"
#include "geometry/line3.hpp"

namespace ipl_slam {

/// The residual of one observed end point against a line, and its derivatives, the project's only statement
/// of them (paper section 3.5):
///
///   e = d(x, l) = x^T l / sqrt(l_1^2 + l_2^2)     pixels, with l = K_line n the projected line
///
/// n and d are moment and direction of the line in the camera frame (geometry/line3.hpp). The projection does
/// not depend on d; the pose does act on n through it: n_c = R n_w + t x d_c.
///
/// For lines that have an image (project_line). S is double, or a vector type of several lines side by side.
template <class S>
struct LineResidual {
  S e;               ///< signed distance, pixels
  S jacobian_n[3];   ///< d e / d n
  S jacobian_xi[6];  ///< d e / d xi for T_cw <- exp(xi) T_cw, xi = (rho, phi)
};

/// out = a x b.
template <class S>
[[gnu::always_inline]] inline void cross(const S (&a)[3], const S (&b)[3], S* out) {
  out[0] = a[1] * b[2] - a[2] * b[1], out[1] = a[2] * b[0] - a[0] * b[2], out[2] = a[0] * b[1] - a[1] * b[0];
}

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
  cross(d, g, out.jacobian_xi);
  cross(n, g, out.jacobian_xi + 3);
}

/// The residual of the inverse depth measured at an end point, and its derivatives:
///
///   e = w_measured - (r x d)^T n / n^T n          1/m, with r the ray of the pixel at z = 1
///
/// It has no counterpart in the paper; its standard deviation is the caller's matter. For lines at least
/// kMinLineDistance from the camera centre.
template <class S>
struct LineDepthResidual {
  S e;               ///< measured minus predicted inverse depth, 1/m
  S jacobian_n[3];   ///< d e / d n
  S jacobian_d[3];   ///< d e / d d
  S jacobian_xi[6];  ///< d e / d xi for T_cw <- exp(xi) T_cw, xi = (rho, phi)
};

/// Residual of the inverse depth measured at the undistorted pixel (u, v).
template <class S>
[[gnu::always_inline]] inline void line_depth_residual(const Camera& camera, const S (&n)[3], const S (&d)[3],
                                                       const S& u, const S& v, const S& inverse_depth,
                                                       LineDepthResidual<S>& out) {
  const S ray[3] = {(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, S{} + 1.0};
  S rd[3], nr[3];
  cross(ray, d, rd);
  cross(n, ray, nr);  // (r x d)^T n = d^T (n x r)
  const S i = 1.0 / (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  const S w = (rd[0] * n[0] + rd[1] * n[1] + rd[2] * n[2]) * i;
  out.e = inverse_depth - w;
  for (int k = 0; k < 3; ++k) {
    out.jacobian_n[k] = (2.0 * w * n[k] - rd[k]) * i;
    out.jacobian_d[k] = -nr[k] * i;
  }
  // n <- n + rho x d + phi x n and d <- d + phi x d.
  S nxn[3], dxd[3];
  cross(d, out.jacobian_n, out.jacobian_xi);
  cross(n, out.jacobian_n, nxn);
  cross(d, out.jacobian_d, dxd);
  for (int k = 0; k < 3; ++k) out.jacobian_xi[3 + k] = nxn[k] + dxd[k];
}

}  // namespace ipl_slam
