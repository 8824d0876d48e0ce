#include "tracking/pose_optimizer_line_kernel.hpp"

#include <array>

#include "geometry/line_reprojection.hpp"
#include "geometry/reprojection.hpp"

namespace ipl_slam::pose_kernel {
namespace {

// A line in a plane through the camera centre that lies this near to parallel to the image plane, sine
// squared, shows some 1e6 focal lengths away from the image.
constexpr double kMinSlope2 = 1e-12;

constexpr std::array<int, 6> kAllColumns{0, 1, 2, 3, 4, 5};

// Positive where the ray of an observed end point meets the line before the camera: inverse_depth_at() but
// for the scale. `nearest` is the point of the line that is nearest to the camera. (Vectors are returned by
// reference because a function that returns them by value has another calling convention with AVX than
// without.)
[[gnu::always_inline]] inline void sight(const Camera& camera, const Lanes (&nearest)[3], const Lanes& u,
                                         const Lanes& v, Lanes& out) {
  out = (u - camera.cx) * (1.0 / camera.fx) * nearest[0] + (v - camera.cy) * (1.0 / camera.fy) * nearest[1] +
        nearest[2];
}

[[gnu::always_inline]] inline bool any_depth(const Lanes& start_info, const Lanes& end_info) {
  bool any = false;
  for (std::size_t l = 0; l < kLanes; ++l) any |= start_info[l] > 0.0 || end_info[l] > 0.0;
  return any;
}

[[gnu::always_inline]] inline void evaluate_lanes(const Camera& camera, const SE3& T_cw, bool robust,
                                                  LineTable& table, Normal& out) {
  const Eigen::Matrix3d R = T_cw.rotation_matrix();
  const Eigen::Vector3d t = T_cw.translation();
  const Lanes zero{}, one = zero + 1.0, behind_chi2 = zero + kBehindCameraChi2;
  Lanes buffer;
  const auto root = [&buffer](const Lanes& v) __attribute__((always_inline))->const Lanes& {
    buffer = v;
    square_root(buffer);
    return buffer;
  };
  LaneSums sums;
  for (LineTable::Block& block : table.blocks()) {
    Lanes(&m)[kLineFields] = block.field;
    Lanes n[3], d[3];
    for (int r = 0; r < 3; ++r)
      d[r] = R(r, 0) * m[kDirectionX] + R(r, 1) * m[kDirectionY] + R(r, 2) * m[kDirectionZ];
    for (int r = 0; r < 3; ++r)
      n[r] = R(r, 0) * m[kMomentX] + R(r, 1) * m[kMomentY] + R(r, 2) * m[kMomentZ] +
             (t[(r + 1) % 3] * d[(r + 2) % 3] - t[(r + 2) % 3] * d[(r + 1) % 3]);
    const Lanes nearest[3] = {d[1] * n[2] - d[2] * n[1], d[2] * n[0] - d[0] * n[2],
                              d[0] * n[1] - d[1] * n[0]};
    Lanes sight_start, sight_end;
    sight(camera, nearest, m[kStartU], m[kStartV], sight_start);
    sight(camera, nearest, m[kEndU], m[kEndV], sight_end);
    // The test on n_x and n_y keeps out the horizon of the camera's own plane, which shows nowhere.
    const Lanes flat2 = n[0] * n[0] + n[1] * n[1], distance2 = flat2 + n[2] * n[2];
    const Mask seen = (distance2 > kMinLineDistance * kMinLineDistance) & (flat2 > kMinSlope2 * distance2) &
                      (sight_start > 0.0) & (sight_end > 0.0);
    n[0] = seen ? n[0] : one;
    ProjectedLine<Lanes> l;
    project_moment(camera, n, root, l);
    LineResidual<Lanes> start, end;
    line_residual(camera, n, d, l, m[kStartU], m[kStartV], start);
    line_residual(camera, n, d, l, m[kEndU], m[kEndV], end);
    Lanes squares = (start.e * start.e + end.e * end.e) * m[kLineInfo];
    // Most frames have points enough to do without the lines' depth.
    const bool with_depth = any_depth(m[kStartDepthInfo], m[kEndDepthInfo]);
    LineDepthResidual<Lanes> start_depth, end_depth;
    if (with_depth) {
      line_depth_residual(camera, n, d, m[kStartU], m[kStartV], m[kStartInverseDepth], start_depth);
      line_depth_residual(camera, n, d, m[kEndU], m[kEndV], m[kEndInverseDepth], end_depth);
      squares +=
          start_depth.e * start_depth.e * m[kStartDepthInfo] + end_depth.e * end_depth.e * m[kEndDepthInfo];
    }
    const Lanes chi2 = seen ? squares : behind_chi2;
    m[kLineChi2] = chi2;

    Lanes weight = seen ? m[kLineWeight] : zero;
    Lanes loss = m[kLineWeight] * chi2;
    if (robust) apply_huber(m[kLineHuber], loss, weight);
    sums.cost += loss;
    const Lanes info = weight * m[kLineInfo];
    sums.add_row(kAllColumns, start.jacobian_xi, start.e, info);
    sums.add_row(kAllColumns, end.jacobian_xi, end.e, info);
    if (with_depth) {
      sums.add_row(kAllColumns, start_depth.jacobian_xi, start_depth.e, weight * m[kStartDepthInfo]);
      sums.add_row(kAllColumns, end_depth.jacobian_xi, end_depth.e, weight * m[kEndDepthInfo]);
    }
  }
  sums.add_to(out);
}

}  // namespace

void evaluate_lines_portable(const Camera& camera, const SE3& T_cw, bool robust, LineTable& table,
                             Normal& out) {
  evaluate_lanes(camera, T_cw, robust, table, out);
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) static void evaluate_lines_avx2(const Camera& camera, const SE3& T_cw,
                                                                bool robust, LineTable& table, Normal& out) {
  evaluate_lanes(camera, T_cw, robust, table, out);
}
#endif

void evaluate_lines(const Camera& camera, const SE3& T_cw, bool robust, LineTable& table, Normal& out) {
#if defined(__x86_64__)
  static const bool avx2 = __builtin_cpu_supports("avx2");
  if (avx2) return evaluate_lines_avx2(camera, T_cw, robust, table, out);
#endif
  evaluate_lines_portable(camera, T_cw, robust, table, out);
}

}  // namespace ipl_slam::pose_kernel
