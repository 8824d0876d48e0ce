#include "tracking/pose_optimizer_kernel.hpp"

#include "geometry/reprojection.hpp"

namespace ipl_slam::pose_kernel {
namespace {

[[gnu::always_inline]] inline void evaluate_lanes(const Camera& camera, const SE3& T_cw, bool robust,
                                                  MatchTable& table, Normal& out) {
  const Eigen::Matrix3d R = T_cw.rotation_matrix();
  const Eigen::Vector3d t = T_cw.translation();
  LaneSums sums;
  const Lanes zero{}, one = zero + 1.0, behind_chi2 = zero + kBehindCameraChi2;
  for (MatchTable::Block& block : table.blocks()) {
    Lanes(&m)[kFields] = block.field;
    const Lanes x = R(0, 0) * m[kX] + R(0, 1) * m[kY] + R(0, 2) * m[kZ] + t[0];
    const Lanes y = R(1, 0) * m[kX] + R(1, 1) * m[kY] + R(1, 2) * m[kZ] + t[1];
    const Lanes z = R(2, 0) * m[kX] + R(2, 1) * m[kY] + R(2, 2) * m[kZ] + t[2];
    const Mask in_front = z >= kMinProjectionDepth;
    PointResidual<Lanes> r;
    const Lanes z_safe = in_front ? z : one;
    point_residual(camera, x, y, z_safe, m[kU], m[kV], m[kInverseDepth], r);
    const Lanes seen =
        r.e[0] * r.e[0] * m[kPixelInfo] + r.e[1] * r.e[1] * m[kPixelInfo] + r.e[2] * r.e[2] * m[kDepthInfo];
    const Lanes chi2 = in_front ? seen : behind_chi2;
    m[kChi2] = chi2;

    Lanes weight = in_front ? m[kWeight] : zero;
    Lanes loss = m[kWeight] * chi2;
    if (robust) apply_huber(m[kHuber], loss, weight);
    sums.cost += loss;
    const Lanes pixel_weight = weight * m[kPixelInfo];
    sums.add_row(kColumnsU, r.jacobian[0], r.e[0], pixel_weight);
    sums.add_row(kColumnsV, r.jacobian[1], r.e[1], pixel_weight);
    sums.add_row(kColumnsD, r.jacobian[2], r.e[2], weight * m[kDepthInfo]);
  }
  out = {};
  sums.add_to(out);
}

}  // namespace

void evaluate_portable(const Camera& camera, const SE3& T_cw, bool robust, MatchTable& table, Normal& out) {
  evaluate_lanes(camera, T_cw, robust, table, out);
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) static void evaluate_avx2(const Camera& camera, const SE3& T_cw, bool robust,
                                                          MatchTable& table, Normal& out) {
  evaluate_lanes(camera, T_cw, robust, table, out);
}
#endif

void evaluate(const Camera& camera, const SE3& T_cw, bool robust, MatchTable& table, Normal& out) {
#if defined(__x86_64__)
  static const bool avx2 = __builtin_cpu_supports("avx2");
  if (avx2) return evaluate_avx2(camera, T_cw, robust, table, out);
#endif
  evaluate_portable(camera, T_cw, robust, table, out);
}

}  // namespace ipl_slam::pose_kernel
