#pragma once

#include <array>

#include "geometry/camera.hpp"

namespace ipl_slam {

/// A point nearer to the camera plane than this, or behind it, has no projection, metres.
inline constexpr double kMinProjectionDepth = 0.01;

/// What an observation costs, in squared standard deviations, while its point has no projection (see
/// kMinProjectionDepth). A constant: it holds an optimiser back from hiding points behind the camera without
/// pulling at anything.
inline constexpr double kBehindCameraChi2 = 1e4;

/// The residual of one observed point and its derivatives, the project's only statement of them:
///
///   e_u = u - (fx x/z + cx),   e_v = v - (fy y/z + cy)        pixels, paper section 3.5
///   e_d = 1/z_measured - 1/z                                  1/m
///
/// with (x, y, z) = T_cw P_w. The third row has no counterpart in the paper: a depth camera measures
/// disparity, whose error is constant in inverse depth (see DepthNoiseOptions).
///
/// `jacobian` is d e / d xi for T_cw <- exp(xi) T_cw, xi = (rho, phi). Because of d p_c / d rho = I its first
/// three columns are d e / d p_c, and d e / d P_w is those columns times the rotation matrix of T_cw.
///
/// S is double, or a vector type of several points side by side.
template <class S>
struct PointResidual {
  S e[3];
  S jacobian[3][6];
};

/// Columns of the rows of PointResidual::jacobian that are not zero for every point.
inline constexpr std::array<int, 5> kColumnsU{0, 2, 3, 4, 5};
inline constexpr std::array<int, 5> kColumnsV{1, 2, 3, 4, 5};
inline constexpr std::array<int, 3> kColumnsD{2, 3, 4};

/// Residual of the camera-frame point (x, y, z), z >= kMinProjectionDepth, seen at the undistorted pixel (u,
/// v) with the measured inverse depth (1/m; any number where there is none, the caller then leaves the third
/// row out).
template <class S>
[[gnu::always_inline]] inline void point_residual(const Camera& camera, const S& x, const S& y, const S& z,
                                                  const S& u, const S& v, const S& inverse_depth,
                                                  PointResidual<S>& out) {
  const S i = 1.0 / z;
  const S a = x * i, b = y * i, ai = a * i, bi = b * i, ab = a * b;
  const double fx = camera.fx, fy = camera.fy;
  out.e[0] = u - (fx * a + camera.cx);
  out.e[1] = v - (fy * b + camera.cy);
  out.e[2] = inverse_depth - i;
  const S zero{};
  S(&ju)[6] = out.jacobian[0];
  ju[0] = -fx * i, ju[1] = zero, ju[2] = fx * ai;
  ju[3] = fx * ab, ju[4] = -fx * (1.0 + a * a), ju[5] = fx * b;
  S(&jv)[6] = out.jacobian[1];
  jv[0] = zero, jv[1] = -fy * i, jv[2] = fy * bi;
  jv[3] = fy * (1.0 + b * b), jv[4] = -fy * ab, jv[5] = -fy * a;
  S(&jd)[6] = out.jacobian[2];
  jd[0] = zero, jd[1] = zero, jd[2] = i * i;
  jd[3] = bi, jd[4] = -ai, jd[5] = zero;
}

}  // namespace ipl_slam
